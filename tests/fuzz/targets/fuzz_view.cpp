// A view, or after a zero byte a view and a patch -> codec, merge patch, completion, and a picture
// of a few pixels.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/data/resident/store.hpp"
#include "server/frame/frame.hpp"
#include "server/tasks/catalogue.hpp"
#include "tests/fuzz/support/check.hpp"

namespace {

using fuzz::expect;
using windsplat::protocol::ViewDocument;
namespace limits = windsplat::protocol::limits;

// One small dataset of lines and medium under any name.
struct Surroundings {
  std::shared_ptr<windsplat::data::Store> store =
      std::make_shared<windsplat::data::Store>(std::uint64_t{256} << 20);
  windsplat::tasks::Catalogue catalogue{store};
  std::shared_ptr<windsplat::data::Dataset> dataset = store->add("climate:8x6x4").value();
  windsplat::ThreadPool pool{1};
  windsplat::frame::Workspace space;
};

Surroundings& surroundings() {
  static Surroundings all;
  return all;
}

void expect_same_again(const ViewDocument& document) {
  const auto again = ViewDocument::parse(document.canonical());
  expect(again.has_value(), "a canonical view is accepted again", document.canonical());
  expect(again->canonical() == document.canonical(), "a canonical view is unchanged",
         document.canonical());
  const std::string full = encode_view(document.view());
  const auto complete = ViewDocument::parse(full);
  expect(complete.has_value(), "a view written in full is accepted", full);
  expect(encode_view(complete->view()) == full, "a view written in full is unchanged", full);
}

void expect_within_limits(const windsplat::protocol::View& view) {
  const std::int64_t width = view.image.width;
  const std::int64_t height = view.image.height;
  expect(width >= 1 && height >= 1 && width <= limits::image_edge_max &&
             height <= limits::image_edge_max && width * height <= limits::image_pixels_max,
         "a picture's size is within the limits");
  expect(!view.vector.stride ||
             (*view.vector.stride >= 1 && *view.vector.stride <= limits::stride_max),
         "a stride is within the limits");
  expect(view.vector.span >= limits::span_min && view.vector.span <= limits::span_max,
         "a kernel is within the limits");
}

// Everything but the number of pixels is taken from the view.
void draw(windsplat::protocol::View view) {
  Surroundings& all = surroundings();
  constexpr int edge_max = 24;
  view.dataset = all.dataset->info().id;
  view.step %= static_cast<int>(all.dataset->info().steps.size());
  const auto checked = all.catalogue.check(view);
  view.image.width = std::min(view.image.width, edge_max);
  view.image.height = std::min(view.image.height, edge_max);
  view.method.name = view.method.name == windsplat::protocol::MethodName::reference
                         ? windsplat::protocol::MethodName::kernel
                         : view.method.name;
  // Many thin slabs are valid, but slow.
  view.method.slab_thickness = std::max(view.method.slab_thickness, 0.5);
  const auto frame = windsplat::frame::produce(view, *all.dataset, {}, all.pool,
                                               windsplat::CancelToken(), all.space);
  if (frame) {
    expect(!frame->bytes.empty(), "a picture has bytes");
  } else {
    const auto kind = frame.error().kind;
    expect(kind != windsplat::ErrorKind::internal, "no view may cause an internal error",
           frame.error().message);
    expect(!frame.error().message.empty(), "a refusal has a reason");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  const std::size_t cut = std::min(text.find('\0'), text.size());
  const auto base = ViewDocument::parse(text.substr(0, cut));
  if (!base) {
    expect(!base.error().message.empty(), "a refusal has a reason");
    return 0;
  }
  expect_same_again(*base);
  ViewDocument document = *base;
  if (cut < text.size()) {
    const std::string_view patch = text.substr(cut + 1);
    const auto patched = base->patched(patch);
    if (!patched) return 0;
    const auto twice = patched->patched(patch);
    expect(twice.has_value() && twice->canonical() == patched->canonical(),
           "applying a patch twice equals applying it once", patched->canonical());
    expect_same_again(*patched);
    document = *patched;
  }
  const windsplat::protocol::View view = document.view();
  expect_within_limits(view);
  draw(view);
  return 0;
}
