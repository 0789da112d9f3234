#include "server/api/measure/selection.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "server/api/measure/positions.hpp"
#include "server/data/model/box.hpp"
#include "server/data/resident/budget.hpp"

namespace windsplat::api {

namespace {

// The indices from..to of the samples of a selection along an axis that lie in a range.
struct Taken {
  int from = 0;
  int to = 0;
};
Taken taken_in(const Selection& selection, std::size_t axis, int first, int count) {
  const int stride = selection.stride.at(axis);
  const int before = first - selection.crop.first.at(axis);  // at least 0
  const int beyond = std::min(before + count, selection.crop.count.at(axis));
  return {(before + stride - 1) / stride, (beyond + stride - 1) / stride};
}

// A box of the samples that a selection lies in. Along x its samples are `turned` before those of
// the crop, which count on beyond the end of the data.
struct Span {
  data::Box box;
  int turned = 0;
};
std::vector<Span> spans_of(const scene::Crop& crop) {
  std::vector<Span> out;
  const int end = crop.first[0] + crop.count[0];
  for (int x = crop.first[0]; x < end;) {
    const int turned = crop.turn > 0 ? x - x % crop.turn : 0;
    Span span{{crop.first, crop.count}, turned};
    span.box.first[0] = x - turned;
    span.box.count[0] = (crop.turn > 0 ? std::min(end, turned + crop.turn) : end) - x;
    x += span.box.count[0];
    out.push_back(span);
  }
  return out;
}

// Copies the taken values of a span from a volume whose first sample is `first`; those of columns
// that the crop does not keep are masked. `to`: all values of the selection.
void copy_values(const data::Volume& volume, const std::array<int, 3>& first, const Span& span,
                 const Selection& selection, std::uint8_t* to) {
  const scene::Crop& crop = selection.crop;
  const Taken x = taken_in(selection, 0, span.box.first[0] + span.turned, span.box.count[0]);
  const Taken y = taken_in(selection, 1, span.box.first[1], span.box.count[1]);
  const Taken z = taken_in(selection, 2, span.box.first[2], span.box.count[2]);
  std::vector<float> row(static_cast<std::size_t>(std::max(0, x.to - x.from)));
  if (row.empty()) return;
  const auto [stride_x, stride_y, stride_z] = selection.stride;
  const std::ptrdiff_t before = crop.first[0] - span.turned - first[0];
  for (std::size_t c = 0; c < selection.components; ++c) {
    for (int k = z.from; k < z.to; ++k) {
      for (int j = y.from; j < y.to; ++j) {
        const std::ptrdiff_t layer = crop.first[2] + std::ptrdiff_t{k} * stride_z - first[2];
        const std::ptrdiff_t line =
            layer * volume.dims[1] + crop.first[1] + std::ptrdiff_t{j} * stride_y - first[1];
        const float* const from = volume.component(static_cast<int>(c)) + line * volume.dims[0];
        const unsigned char* const kept =
            crop.columns ? crop.columns->data() + std::ptrdiff_t{j} * stride_y * crop.count[0]
                         : nullptr;
        for (int i = x.from; i < x.to; ++i) {
          const std::ptrdiff_t at = std::ptrdiff_t{i} * stride_x;
          const bool there = kept == nullptr || kept[at] != 0;
          row[static_cast<std::size_t>(i - x.from)] =
              there ? from[before + at] : std::numeric_limits<float>::quiet_NaN();
        }
        const std::size_t rows =
            (c * selection.count[2] + static_cast<std::size_t>(k)) * selection.count[1] +
            static_cast<std::size_t>(j);
        const std::size_t at = rows * selection.count[0] + static_cast<std::size_t>(x.from);
        std::memcpy(to + at * sizeof(float), row.data(), row.size() * sizeof(float));
      }
    }
  }
}

// Whether what a selection takes is read without the rest of the step.
bool is_read_apart(const Subject& subject, const Selection& selection) {
  std::vector<data::Box> boxes;
  for (const Span& span : spans_of(selection.crop)) boxes.push_back(span.box);
  return subject.dataset->reads_apart(subject.field.name, selection.step, boxes,
                                      selection.stride[2]);
}

// What a request reads apart is at most what a field may have that is read as a whole.
Result<void> check_cost(const Subject& subject, const Selection& selection) {
  const std::array<int, 3> dims = subject.dataset->info().grid.dims();
  double share = 0;
  for (const Span& span : spans_of(selection.crop)) {
    share += data::decoded_share(span.box, selection.stride[2], subject.field, dims);
  }
  const auto step = static_cast<double>(data::whole_box(dims).samples() *
                                        subject.field.components.size() * sizeof(float));
  const double bytes = share * step;
  if (bytes <= static_cast<double>(data::volume_bytes_max)) return {};
  return make_error(ErrorKind::invalid,
                    "the array would read " + data::megabytes(static_cast<std::uint64_t>(bytes)) +
                        " of " + in_quotes(subject.field.name) + ", and a request reads at most " +
                        data::megabytes(data::volume_bytes_max) +
                        ": take a smaller box, or fewer levels");
}

// Reads it piece by piece.
Result<void> copy_pieces(const Subject& subject, const Selection& selection, std::uint8_t* to) {
  constexpr std::size_t piece_values = std::size_t{4} << 20;
  const std::array<int, 3> dims = subject.dataset->info().grid.dims();
  for (const Span& span : spans_of(selection.crop)) {
    const int apart = data::layers_apart(span.box, selection.stride[2], subject.field, dims);
    for (const data::Box& piece : data::pieces_of(span.box, apart, subject.field, piece_values)) {
      if (subject.cancel.cancelled()) {
        return make_error(ErrorKind::cancelled, "request cancelled");
      }
      const auto part = load_part(*subject.catalogue, *subject.dataset, subject.field.name,
                                  selection.step, piece, subject.cancel);
      if (!part) return part.error();
      copy_values(**part, piece.first, {piece, span.turned}, selection, to);
    }
  }
  return {};
}

}  // namespace

Result<std::shared_ptr<const data::Volume>> whole_for(const Subject& subject,
                                                      const Selection& selection) {
  if (!is_read_apart(subject, selection)) return load(subject, selection.step);
  if (auto small = check_cost(subject, selection); !small) return small.error();
  return std::shared_ptr<const data::Volume>();
}

Result<void> copy_selected(const std::shared_ptr<const data::Volume>& whole, const Subject& subject,
                           const Selection& selection, std::uint8_t* to) {
  if (!whole) return copy_pieces(subject, selection, to);
  for (const Span& span : spans_of(selection.crop)) copy_values(*whole, {}, span, selection, to);
  return {};
}

}  // namespace windsplat::api
