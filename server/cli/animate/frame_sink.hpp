// Where the pictures of an animation go: numbered files, or a movie.
#pragma once

#include <memory>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/cli/animate/plan.hpp"
#include "server/cli/beside/sheets.hpp"
#include "server/movie/writer.hpp"

namespace windsplat::cli {

class FrameSink {
 public:
  // The plan must outlive this object. `output`: the name of a movie, or - for stdout. Errors:
  // those of find_ffmpeg() and choose_encoder(), so that they come before anything is drawn.
  static Result<FrameSink> of(const Plan& plan, std::string output, const CancelToken& cancel);

  // Encoding of the pictures of add().
  [[nodiscard]] frame::Encoding encoding(const ViewArguments& arguments) const;

  // Errors: those of write_output() and movie::Writer.
  Result<void> add(int frame, const Sheet& sheet);
  // Completes a movie. Errors: those of movie::Writer.
  Result<void> finish();

 private:
  FrameSink(const Plan& plan, std::string output, const CancelToken& cancel)
      : plan_(&plan), output_(std::move(output)), cancel_(cancel) {}

  const Plan* plan_;
  std::string output_;
  CancelToken cancel_;
  std::unique_ptr<movie::Writer> movie_;  // opened with the first picture, which tells the size
};

}  // namespace windsplat::cli
