// Draws runs of pixels, each once, on the first free thread.
#include "server/frame/reference.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/trim_storage.hpp"
#include "server/frame/measure.hpp"
#include "server/image/encode.hpp"
#include "server/scene/build.hpp"

namespace windsplat::frame {
namespace {

constexpr std::size_t rgba_channels = 4;
constexpr int piece_pixels = 32;  // pixels of a row: a few milliseconds

// Reserves the memory of one drawing; an error states the total that is needed.
class CountedMemory {
 public:
  explicit CountedMemory(const WorkMemory& memory) : memory_(memory) {}

  Result<std::shared_ptr<const void>> reserve(std::uint64_t bytes) {
    auto held = memory_.reserve(bytes);
    if (held || held.error().kind != ErrorKind::out_of_memory) {
      held_ += bytes;
      return held;
    }
    std::string detail = "the reference of this view needs at least ";
    detail += data::megabytes(held_ + bytes) + " of memory, but ";
    detail += data::megabytes(held_ + memory_.room()) + " are free: ";
    detail += "ask for a smaller picture or a larger stride";
    return make_error_at(ErrorKind::out_of_memory, "/image", std::move(detail));
  }

 private:
  const WorkMemory& memory_;
  std::uint64_t held_ = 0;
};

Error unwanted() { return make_error(ErrorKind::cancelled, "reference cancelled"); }

}  // namespace

ReferenceDrawing::ReferenceDrawing(scene::Scene own, std::array<float, 3> background, int width,
                                   int height)
    : own_(std::move(own)),
      background_(background),
      width_(width),
      height_(height),
      pieces_a_row_(static_cast<std::size_t>((width + piece_pixels - 1) / piece_pixels)) {}

Result<std::unique_ptr<ReferenceDrawing>> ReferenceDrawing::begin(
    const scene::CompletedView& completed, data::Dataset& dataset, unsigned workers,
    const CancelToken& cancel, const WorkMemory& memory) {
  if (cancel.cancelled()) return unwanted();
  auto own = scene::build_scene(completed, dataset);
  if (!own) return own.error();
  const auto exact = completed.with(
      [](protocol::View& view) { view.method.name = protocol::MethodName::reference; });
  if (!exact) return exact.error();
  const auto truth = scene::build_scene(*exact, dataset);
  if (!truth) return truth.error();
  if (cancel.cancelled()) return unwanted();
  const int width = truth->camera.width;
  const int height = truth->camera.height;
  std::unique_ptr<ReferenceDrawing> drawing(
      new ReferenceDrawing(std::move(*own), truth->background, width, height));
  drawing->drawn_.resize(drawing->pieces_a_row_ * static_cast<std::size_t>(height));
  const std::uint64_t values =
      rgba_channels * static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  CountedMemory counted(memory);
  auto reserved = counted.reserve(values * sizeof(float));
  if (!reserved) return reserved.error();
  drawing->reserved_ = std::move(*reserved);
  drawing->rgba_.resize(values);
  auto painting = engine::reference::Painting::begin(
      *truth, workers, cancel, {}, [&](std::uint64_t bytes) { return counted.reserve(bytes); });
  if (!painting) return painting.error();
  drawing->painting_ = std::move(*painting);
  return drawing;
}

void ReferenceDrawing::draw_piece(std::size_t piece, unsigned worker, const CancelToken& cancel) {
  const auto row = static_cast<int>(piece / pieces_a_row_);
  const int x0 = static_cast<int>(piece % pieces_a_row_) * piece_pixels;
  const int x1 = std::min(x0 + piece_pixels, width_);
  std::array<double, rgba_channels * piece_pixels> light{};
  if (!painting_->draw(row, x0, x1, worker, cancel, light.data())) return;
  const std::size_t at =
      rgba_channels * (static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                       static_cast<std::size_t>(x0));
  std::transform(light.begin(), light.begin() + rgba_channels * static_cast<std::size_t>(x1 - x0),
                 rgba_.begin() + static_cast<std::ptrdiff_t>(at),
                 [](double value) { return static_cast<float>(value); });
  drawn_[piece] = 1;
}

void ReferenceDrawing::draw(ThreadPool& pool, const CancelToken& cancel,
                            const std::function<bool()>& enough) {
  const std::size_t first = first_open_;
  pool.run(drawn_.size() - first, [&](std::size_t n, unsigned worker) {
    const std::size_t piece = first + n;
    if (drawn_[piece] == 0 && !cancel.cancelled() && !enough()) draw_piece(piece, worker, cancel);
  });
  while (first_open_ < drawn_.size() && drawn_[first_open_] != 0) ++first_open_;
}

double ReferenceDrawing::done() const {
  return static_cast<double>(first_open_) / static_cast<double>(drawn_.size());
}

Result<Difference> ReferenceDrawing::compare(ThreadPool& pool, const CancelToken& cancel,
                                             Workspace& workspace) {
  WINDSPLAT_CHECK(first_open_ == drawn_.size());
  const auto work = engine::render(own_, pool, cancel, workspace.space);
  if (!work) return work.error();
  std::vector<float>& picture = workspace.space.image().rgba;
  const Difference difference = difference_of(picture, rgba_);
  trim_storage(picture, 0, 0);
  return difference;
}

Result<image::Bytes> ReferenceDrawing::encode_png() const {
  return image::encode_png(image::tone_map(rgba_, width_, height_, background_), width_, height_);
}

}  // namespace windsplat::frame
