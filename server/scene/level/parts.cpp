#include "server/scene/level/parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <set>
#include <utility>

#include "protocol/view/shown.hpp"
#include "server/data/model/middles.hpp"
#include "server/data/model/stored.hpp"
#include "server/data/resident/budget.hpp"
#include "server/scene/detail.hpp"
#include "server/scene/level/sight.hpp"
#include "server/scene/lines/mark.hpp"
#include "server/scene/lines/reach.hpp"

namespace windsplat::scene {

namespace {

using protocol::absorbs;
using protocol::shows_lines;
using protocol::View;

constexpr int brick_kernels = 8;  // along an axis: of the bricks that the engine culls
constexpr std::array full{0, 0, 0};
// Of the memory limit: the parts before and after a change of the camera exist at the same time.
constexpr double part_share_max = 0.45;
// Beyond this the requests to a loader would take most of the time.
constexpr int boxes_max = 2048;
// Boxes within the bounds of a grid, held or not, which are visited for every picture.
constexpr std::size_t places_max = std::size_t{1} << 18;

int halved_stride(const View& view, int halvings) {
  const int stride = view.vector.stride.value_or(1);
  return stride / std::gcd(stride, 1 << halvings);
}

// The lines of a view as far as their extent depends on it.
VectorLayer lines_of(const View& view, const Camera& camera, const Lattice& whole,
                     const std::array<int, 3>& halvings) {
  const protocol::VectorView& from = view.vector;
  VectorLayer layer;
  layer.length = from.length.value();
  layer.span = from.span;
  layer.stride = from.stride.value();
  layer.jitter_center = from.jitter.center;
  layer.jitter_stride = from.jitter.stride;
  layer.overlap = from.jitter.overlap;
  set_radii(from, view.image.height, layer);
  layer.mark = mark_of(from, view.image.height);
  merge_lines(whole, halvings, pixels_per_unit(camera, whole), layer);
  return layer;
}

// Bounds that the engine's culling does not exceed (kernel_reach in engine/bins, Projector).
Reach reach_of(const View& view, const Camera& camera, const Lattice& whole,
               const std::array<int, 3>& halvings, const Lattice& level) {
  constexpr double rounding = 1.001;
  constexpr double footprint_radius = 1.37;  // cells
  constexpr double pixels_beside = 1.5;
  std::array<double, 3> cells{};
  for (std::size_t a = 0; a < 3; ++a) {
    cells[a] = *std::max_element(level.spacing[a].begin(), level.spacing[a].end());
  }
  Reach out;
  out.pixels = pixels_beside;
  for (const protocol::ScalarView& scalar : *view.scalars) {
    if (!absorbs(scalar)) continue;
    for (std::size_t a = 0; a < 3; ++a) {
      const double splat = footprint_radius * cells[a] * scalar.stride;
      out.world[a] = std::max(out.world[a], rounding * splat);
    }
  }
  if (!shows_lines(view)) return out;
  const VectorLayer lines = lines_of(view, camera, whole, halvings);
  std::array<double, 3> strided = cells;
  for (double& cell : strided) cell *= lines.stride;
  const auto reach = line_reach(lines, strided);
  for (std::size_t a = 0; a < 3; ++a) {
    out.world[a] = std::max(out.world[a], rounding * reach[a]);
  }
  out.pixels += rounding * outer_radius(lines);
  return out;
}

data::Box box_of_units(const Units& units, const std::array<int, 3>& quantum,
                       const std::array<int, 3>& dims) {
  data::Box box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.first[a] = units[a][0] * quantum[a];
    box.count[a] = std::min(units[a][1] * quantum[a], dims[a]) - box.first[a];
  }
  return box;
}

int rounded_up(int value, int unit) { return (value - 1) / unit * unit + unit; }

// Below `most`, the least common multiple of both; otherwise `most`.
int common_multiple(int quantum, int stride, int most) {
  return static_cast<int>(std::min<std::int64_t>(std::lcm(std::int64_t{quantum}, stride), most));
}

// Bricks of the store, which are those of every level.
std::array<int, 3> brick_of(const std::vector<ShownField>& shown, const data::DatasetInfo& info) {
  std::array<int, 3> brick{1, 1, 1};
  for (const ShownField& one : shown) {
    if (one.all) continue;
    const data::FieldInfo& field = *info.find(one.field);
    for (std::size_t a = 0; a < 3; ++a) brick[a] = std::max(brick[a], field.box_chunk[a]);
  }
  return brick;
}

// Of the volumes of a part, and of those from which they are drawn; nullopt: a field has no such
// level.
std::optional<std::uint64_t> bytes_of(const std::vector<ShownField>& shown,
                                      const data::HeldPart& part, const data::Dataset& dataset) {
  std::set<std::pair<std::string, data::Reduction>> counted;
  std::uint64_t bytes = 0;
  for (const ShownField& one : shown) {
    if (!counted.emplace(one.field, one.coarsening.reduction).second) continue;
    const auto how = part_of_field(dataset, one, part);
    if (!how) return std::nullopt;
    bytes += how->bytes + (how->from ? how->from->bytes : 0);
    if (how->gathered) {  // while a box is read
      const auto box = how->gathered->part(0);
      bytes += box.bytes + (box.from ? box.from->bytes : 0);
    }
  }
  return bytes;
}

// Samples have the key of Dataset::part().
data::Derivation read_of(const data::FieldInfo& field, const data::StoredPart& part) {
  data::Derivation out;
  out.variant = data::part_variant;
  if (part.level > 0) {
    out.variant +=
        data::level_variant(part.level) + std::to_string(static_cast<int>(part.as)) + ' ';
  }
  out.variant += data::key_of(part.box);
  out.bytes = part.box.samples() * static_cast<std::uint64_t>(components_of(field, part.as)) *
              sizeof(float);
  out.stored = part;
  return out;
}

}  // namespace

bool may_use_part(const View& view) { return !view.light && view.surfaces.empty(); }

std::array<int, 3> least_quantum(const View& view, const std::array<int, 3>& dims,
                                 const std::array<int, 3>& halvings, bool lines_apart) {
  const bool lines = shows_lines(view) && !lines_apart;
  std::array<int, 3> quantum{};
  for (std::size_t a = 0; a < 3; ++a) {
    const int samples = data::halved(dims[a], halvings[a]);
    quantum[a] = std::min(brick_kernels, samples);
    if (halvings != full) {
      if (!lines) continue;
      quantum[a] = common_multiple(quantum[a], halved_stride(view, halvings[a]), samples);
      continue;
    }
    int strides = lines ? std::min(view.vector.stride.value_or(1), samples) : 1;
    for (const protocol::ScalarView& scalar : *view.scalars) {
      if (absorbs(scalar)) strides = common_multiple(strides, scalar.stride, samples);
    }
    const std::int64_t kernels = std::int64_t{brick_kernels} * strides;
    quantum[a] = static_cast<int>(std::min<std::int64_t>(kernels, samples));
  }
  return quantum;
}

data::Box box_in_sight(const View& view, const Camera& camera, const Lattice& whole,
                       const std::array<int, 3>& halvings, const std::array<int, 3>& quantum) {
  const Lattice level = coarsen_lattice(whole, halvings);
  const Reach reach = reach_of(view, camera, whole, halvings, level);
  return box_of_units(Sight(camera, level, reach, quantum).bounds(), quantum, level.dims);
}

std::optional<data::BoxGrid> boxes_in_sight(const View& view, const Camera& camera,
                                            const Lattice& whole,
                                            const std::array<int, 3>& halvings,
                                            const std::array<int, 3>& size, int most) {
  const Lattice level = coarsen_lattice(whole, halvings);
  const Reach reach = reach_of(view, camera, whole, halvings, level);
  const auto found = Sight(camera, level, reach, size).boxes(static_cast<std::size_t>(most));
  if (!found) return std::nullopt;
  std::vector<data::Box> boxes;
  for (const Units& units : *found) {
    for (int z = units[2][0]; z < units[2][1]; ++z) {
      for (int y = units[1][0]; y < units[1][1]; ++y) {
        for (int x = units[0][0]; x < units[0][1]; ++x) {
          const Units one{{{x, x + 1}, {y, y + 1}, {z, z + 1}}};
          boxes.push_back(box_of_units(one, size, level.dims));
        }
      }
    }
  }
  data::BoxGrid grid = data::grid_of(boxes, size, level.dims);
  if (grid.places.size() > places_max) return std::nullopt;
  return grid;
}

namespace {

// Looks for what of a level holds what is in sight, within the room for a part.
class PartSearch {
 public:
  PartSearch(const View& view, const Camera& camera, const Lattice& whole,
             const std::array<int, 3>& halvings, const std::vector<ShownField>& shown,
             const data::Dataset& dataset)
      : view_(view),
        camera_(camera),
        whole_(whole),
        halvings_(halvings),
        shown_(shown),
        dataset_(dataset),
        least_(least_quantum(view, whole.dims, halvings, holds_all_lines(shown))) {
    for (const ShownField& field : shown) fields_.push_back(field.field);
  }

  [[nodiscard]] std::optional<data::HeldPart> part() const {
    std::array<int, 3> brick = brick_of(shown_, dataset_.info());
    for (std::size_t a = 0; a < 3; ++a) {
      const int samples = data::halved(whole_.dims[a], halvings_[a]);
      brick[a] = rounded_up(std::min(brick[a], samples), least_[a]);
    }
    const data::Box bounds = box_in_sight(view_, camera_, whole_, halvings_, brick);
    if (!bytes_of(shown_, {bounds, nullptr}, dataset_) || exceeds_room(brick)) return std::nullopt;
    if (auto found = grid(brick, bounds)) return found;
    if (auto found = box(brick, bounds)) return found;
    for (std::array<int, 3> size = brick; size != least_;) {
      size = halved(size);
      if (auto found = grid(size, bounds)) return found;
    }
    return std::nullopt;
  }

 private:
  [[nodiscard]] double room() const {
    return part_share_max * static_cast<double>(dataset_.room_beside_boxes(fields_));
  }

  [[nodiscard]] bool has_room(const data::HeldPart& part) const {
    return static_cast<double>(bytes_of(shown_, part, dataset_).value()) <= room();
  }

  // Whether what lies within the picture as a whole takes more, whatever the size of boxes.
  [[nodiscard]] bool exceeds_room(const std::array<int, 3>& size) const {
    data::Box one;
    for (std::size_t a = 0; a < 3; ++a) one.count[a] = size[a];
    double bytes = 0;
    for (const ShownField& field : shown_) {
      const auto how = part_of_field(dataset_, field, {one, nullptr});
      if (!field.all) bytes += static_cast<double>(how->bytes);
    }
    const Lattice level = coarsen_lattice(whole_, halvings_);
    const Reach reach = reach_of(view_, camera_, whole_, halvings_, level);
    // Fields may be shown several times, and boxes at the end of the data are not full.
    const double units = 8 * static_cast<double>(shown_.size()) * room() / bytes;
    return Sight(camera_, level, reach, size).has_within(static_cast<std::size_t>(units));
  }

  [[nodiscard]] std::array<int, 3> halved(std::array<int, 3> quantum) const {
    for (std::size_t a = 0; a < 3; ++a) {
      quantum[a] = rounded_up(std::max(1, quantum[a] / 2), least_[a]);
    }
    return quantum;
  }

  // Boxes of that size, unless they hold more than half of the bounds or are too many.
  [[nodiscard]] std::optional<data::HeldPart> grid(const std::array<int, 3>& size,
                                                   const data::Box& bounds) const {
    auto found = boxes_in_sight(view_, camera_, whole_, halvings_, size, boxes_max);
    if (!found || 2 * data::samples_of(*found) > bounds.samples()) return std::nullopt;
    data::HeldPart part{found->bounds, std::make_shared<const data::BoxGrid>(std::move(*found))};
    return has_room(part) ? std::optional(std::move(part)) : std::nullopt;
  }

  [[nodiscard]] std::optional<data::HeldPart> box(std::array<int, 3> quantum,
                                                  const data::Box& bounds) const {
    data::HeldPart found{bounds, nullptr};
    while (!has_room(found)) {
      // Smaller units would hardly leave out more than one at each end.
      data::HeldPart inner = found;
      for (std::size_t a = 0; a < 3; ++a) {
        inner.box.count[a] = std::max(1, found.box.count[a] - 2 * quantum[a]);
      }
      if (quantum == least_ || !has_room(inner)) return std::nullopt;
      quantum = halved(quantum);
      found.box = box_in_sight(view_, camera_, whole_, halvings_, quantum);
    }
    return found;
  }

  const View& view_;
  const Camera& camera_;
  const Lattice& whole_;
  const std::array<int, 3>& halvings_;
  const std::vector<ShownField>& shown_;
  const data::Dataset& dataset_;
  const std::array<int, 3> least_;
  std::vector<std::string> fields_;
};

}  // namespace

std::optional<data::HeldPart> part_for(const View& view, const Camera& camera, const Lattice& whole,
                                       const std::array<int, 3>& halvings,
                                       const std::vector<ShownField>& shown,
                                       const data::Dataset& dataset) {
  return PartSearch(view, camera, whole, halvings, shown, dataset).part();
}

namespace {

std::optional<data::Derivation> box_of_field(const data::DatasetInfo& info, const ShownField& shown,
                                             const data::Box& samples) {
  const data::Coarsening& how = shown.coarsening;
  const data::FieldInfo* const about = info.find(shown.field);
  if (about == nullptr) return std::nullopt;
  const data::Box box = shown.middles ? data::strided_box(samples, how.stride) : samples;
  const auto index = static_cast<std::size_t>(about - info.fields.data());
  if (how.halvings == full) {
    if (!about->is_read_by_boxes()) return std::nullopt;
    return read_of(*about, {box});
  }
  if (auto level = stored_level(info, index, how)) {
    level->box = box;
    return read_of(*about, *level);
  }
  if (how.reduction != data::Reduction::drawn) return std::nullopt;
  auto middles = stored_middles(info, index, how.stride);
  if (!middles) return std::nullopt;
  data::Coarsening of_box = how;
  for (std::size_t a = 0; a < 3; ++a) {
    of_box.first[a] = box.first[a] << how.halvings[a];
    const int end = std::min((box.first[a] + box.count[a]) << how.halvings[a], info.grid.dims()[a]);
    middles->box.first[a] = of_box.first[a] / how.stride;
    middles->box.count[a] = (end - 1) / how.stride + 1 - middles->box.first[a];
  }
  data::Derivation out;
  out.variant = data::part_variant;
  if (const auto level = level_of(info, how.halvings)) out.variant += data::level_variant(*level);
  out.variant += data::key_of(how) + ' ' + data::key_of(box);
  out.bytes = box.samples() * about->components.size() * sizeof(float);
  out.from = std::make_shared<const data::Derivation>(read_of(*about, *middles));
  out.make = [of_box, dims = info.grid.dims()](const data::Volume& strided) {
    return data::draw(strided, of_box, dims);
  };
  return out;
}

}  // namespace

bool holds_all_lines(const std::vector<ShownField>& shown) {
  return std::any_of(shown.begin(), shown.end(), [](const ShownField& one) { return one.all; });
}

std::optional<data::Derivation> part_of_field(const data::Dataset& dataset, const ShownField& shown,
                                              const data::HeldPart& part) {
  if (shown.all) return dataset.stored_reduction(shown.field, shown.coarsening);
  const auto info = dataset.shared_info();
  if (!part.grid) return box_of_field(*info, shown, part.box);
  const auto boxes = std::make_shared<const std::vector<data::Box>>(part.grid->boxes());
  auto out = box_of_field(*info, shown, boxes->front());
  if (!out) return std::nullopt;
  data::GatheredBoxes gathered;
  gathered.grid = data::strided_grid(*part.grid, shown.middles ? shown.coarsening.stride : 1);
  gathered.part = [info, shown, boxes](std::size_t n) {
    return box_of_field(*info, shown, (*boxes)[n]).value();
  };
  const data::Box first = gathered.grid.boxes().front();
  out->variant.resize(out->variant.size() - data::key_of(first).size());
  out->variant += data::key_of(gathered.grid);
  out->bytes = out->bytes / first.samples() * data::samples_of(gathered.grid);
  out->make = nullptr;
  out->from = nullptr;
  out->stored = std::nullopt;
  out->gathered = std::make_shared<const data::GatheredBoxes>(std::move(gathered));
  return out;
}

}  // namespace windsplat::scene
