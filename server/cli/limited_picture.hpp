// View -> picture and report, within the time budget and the error bound of the view.
#pragma once

#include <string>
#include <vector>

#include "protocol/messages.hpp"
#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/cli/progress.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/frame/frame.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/tables.hpp"
#include "server/scene/completed_view.hpp"

namespace windsplat::cli {

struct Picture {
  frame::Frame frame;
  protocol::FrameInfo info;  // with the error, if it was measured or estimated
  // Why surfaces have no part in a picture that shows something else.
  std::vector<std::string> empty_surfaces;
};

// Draws the pictures of a command one after another. A view with quality.budgetMs or
// quality.maxError is drawn at every setting first, which takes the time of about thirty pictures;
// its picture has the setting that quality::pick() selects by these times and errors. Later
// pictures of the same scene near the same viewpoint, as of an animation, use the same
// measurements. A picture that exceeds a limit is drawn again if what it shows of the time of
// encoding and of the error leads to another setting.
class LimitedPictures {
 public:
  // The dataset and the pool must outlive this object. The pictures are measured if the encoding
  // says so, or if their error is limited.
  LimitedPictures(data::Dataset& dataset, const frame::Encoding& encoding, ThreadPool& pool)
      : dataset_(dataset), encoding_(encoding), pool_(pool) {
    // A smaller limit has no room for grounds (ground_bytes_of() in cli/open_store.hpp).
    constexpr std::uint64_t roomy = std::uint64_t{2} << 30U;
    if (!dataset.is_within_limit(roomy)) workspace_.space.limit_grounds(0);
  }

  // `show` may be empty. Errors: those of frame::complete(), frame::prepare() and frame::produce();
  // invalid at /quality/budgetMs for a reference, whose time cannot be limited.
  Result<Picture> draw(const protocol::View& view, const CancelToken& cancel,
                       const ShowDone& show = {});

 private:
  Result<void> calibrate(const scene::CompletedView& completed, const CancelToken& cancel,
                         const ShowDone& show);
  // Describes the view, unless it was described before.
  [[nodiscard]] quality::Setting setting_of(const scene::CompletedView& completed,
                                            const CancelToken& cancel);
  Result<Picture> draw_at(const scene::CompletedView& completed, const quality::Setting& setting,
                          const CancelToken& cancel);

  data::Dataset& dataset_;
  frame::Encoding encoding_;
  ThreadPool& pool_;
  quality::Tables tables_;
  frame::Workspace workspace_;
  double encode_ms_a_pixel_ = 0;  // of the last picture
};

// The report of a picture as a line of JSON.
std::string report_line(const Picture& picture);

// Which level of the data the picture has in place of a finer one that would suffice for it but
// does not fit into the memory; empty: none.
std::string coarser_level_of(const Picture& picture);

// Text on each limit of the view that the picture does not keep; empty if it keeps them.
std::string exceeded_limits(const Picture& picture);

}  // namespace windsplat::cli
