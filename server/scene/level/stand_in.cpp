#include "server/scene/level/stand_in.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <string>
#include <utility>

#include "server/data/model/stored.hpp"
#include "server/scene/build.hpp"
#include "server/scene/detail.hpp"
#include "server/scene/level/choice.hpp"

namespace windsplat::scene {

namespace {

// Of the memory limit, beside two boxes; and in bytes, as it is read before what is wanted.
constexpr double base_share_max = 0.1;
constexpr std::uint64_t base_bytes_max = std::uint64_t{64} << 20;

bool is_finer(const std::array<int, 3>& level, const std::array<int, 3>& than) {
  for (std::size_t a = 0; a < 3; ++a) {
    if (level[a] < than[a]) return true;
  }
  return false;
}

// nullopt: there is no such part.
std::optional<data::Derivation> derivation_of(const ShownField& shown,
                                              const std::optional<data::HeldPart>& part,
                                              const data::Dataset& dataset) {
  const auto& [field, how, middles, all] = shown;
  if (part) return part_of_field(dataset, shown, *part);
  auto stored = dataset.stored_reduction(field, how);
  return stored ? std::move(*stored) : dataset.reduction(field, how);
}

// What is shown of one step, and what of it is resident.
class Shown {
 public:
  Shown(const CompletedView& completed, const data::Dataset& dataset)
      : view_(completed.view()),
        completed_(completed),
        dataset_(dataset),
        step_(static_cast<std::size_t>(view_.step)) {}

  [[nodiscard]] std::vector<ShownField> at(const std::array<int, 3>& halvings) const {
    const Lattice& lattice = completed_.lattice();
    return shown_at(view_, coarsening_of(lattice, halvings), lattice, dataset_);
  }

  [[nodiscard]] std::uint64_t missing_bytes(const DrawnPart& part) const {
    std::set<std::pair<std::string, std::string>> counted;
    std::uint64_t bytes = 0;
    for (const ShownField& one : at(part.halvings)) {
      const auto how = derivation_of(one, part.held, dataset_);
      if (!how || dataset_.has(one.field, step_, *how)) continue;
      if (!counted.emplace(one.field, how->variant).second) continue;
      bytes += part.held ? how->bytes : dataset_.level_bytes(one.field, one.coarsening);
    }
    return bytes;
  }

  [[nodiscard]] bool is_resident(const std::vector<ShownField>& shown,
                                 const std::optional<data::HeldPart>& part) const {
    return std::all_of(shown.begin(), shown.end(), [&](const ShownField& one) {
      const auto how = derivation_of(one, part, dataset_);
      return how && dataset_.has(one.field, step_, *how);
    });
  }

  // The smallest resident part of a level that holds what is in sight, and begins and ends as a
  // part of the view does.
  [[nodiscard]] std::optional<data::HeldPart> resident_part(
      const std::array<int, 3>& halvings, const std::vector<ShownField>& shown) const {
    const data::Box any;
    const auto of_part = [](const ShownField& one) { return !one.all; };
    const auto found = std::find_if(shown.begin(), shown.end(), of_part);
    if (found == shown.end()) return std::nullopt;
    const ShownField& one = *found;
    const auto how = part_of_field(dataset_, one, {any, nullptr});
    if (!how) return std::nullopt;
    auto parts = dataset_.resident_parts(one.field, step_, *how, any);
    if (one.middles) expand(one.coarsening.stride, parts);
    if (parts.empty()) return std::nullopt;
    const std::array<int, 3> data_dims = completed_.lattice().dims;
    const std::array<int, 3> quantum =
        least_quantum(view_, data_dims, halvings, holds_all_lines(shown));
    const data::Box sight =
        box_in_sight(view_, completed_.camera(), completed_.lattice(), halvings, quantum);
    const auto fits = [&](const data::HeldPart& part) {
      const data::Box& box = part.box;
      for (std::size_t a = 0; a < 3; ++a) {
        const int end = box.first[a] + box.count[a];
        const bool holds = box.first[a] <= sight.first[a] && end >= sight.first[a] + sight.count[a];
        const bool whole =
            box.first[a] % quantum[a] == 0 &&
            (end % quantum[a] == 0 || end == data::halved(data_dims[a], halvings[a]));
        if (!holds || !whole) return false;
      }
      return (!part.grid || holds_sight(halvings, quantum, *part.grid)) && is_resident(shown, part);
    };
    std::optional<data::HeldPart> best;
    for (const data::HeldPart& part : parts) {
      if ((!best || part.samples() < best->samples()) && fits(part)) best = part;
    }
    return best;
  }

 private:
  [[nodiscard]] bool holds_sight(const std::array<int, 3>& halvings,
                                 const std::array<int, 3>& quantum,
                                 const data::BoxGrid& held) const {
    for (std::size_t a = 0; a < 3; ++a) {
      if (held.size[a] % quantum[a] != 0) return false;
    }
    const auto needed = boxes_in_sight(view_, completed_.camera(), completed_.lattice(), halvings,
                                       held.size, held.held);
    return needed && data::is_held_by(*needed, held);
  }

  // Parts of kernels to those of their samples.
  void expand(int stride, std::vector<data::HeldPart>& parts) const {
    for (data::HeldPart& part : parts) {
      const data::Box kernels = part.box;
      for (std::size_t a = 0; a < 3; ++a) {
        const int end = (kernels.first[a] + kernels.count[a]) * stride;
        part.box.first[a] = kernels.first[a] * stride;
        part.box.count[a] = std::min(end, completed_.lattice().dims[a]) - part.box.first[a];
      }
      if (!part.grid) continue;
      auto grid = std::make_shared<data::BoxGrid>(*part.grid);
      grid->bounds = part.box;
      for (std::size_t a = 0; a < 3; ++a) {
        const int samples = grid->size[a] * stride;
        const bool is_one = grid->count[a] == 1;
        grid->size[a] = is_one ? std::min(samples, completed_.lattice().dims[a]) : samples;
      }
      part.grid = std::move(grid);
    }
  }

  const protocol::View& view_;
  const CompletedView& completed_;
  const data::Dataset& dataset_;
  const std::size_t step_;
};

bool may_stand_in(const CompletedView& completed, const data::Dataset& dataset) {
  return may_use_stored(completed.view(), completed.lattice(), dataset) &&
         may_use_part(completed.view());
}

// Whether the level is stored of all fields, and it and what it is drawn from take little.
bool is_base(const std::vector<ShownField>& shown, const data::Dataset& dataset) {
  std::vector<std::string> fields;
  std::uint64_t bytes = 0;
  for (const auto& [field, how, middles, all] : shown) {
    if (!dataset.stored_reduction(field, how)) return false;
    bytes += dataset.level_bytes(field, how) + dataset.bytes_beside_level(field, how);
    fields.push_back(field);
  }
  if (bytes > base_bytes_max) return false;
  const auto all = static_cast<std::uint64_t>(static_cast<double>(bytes) / base_share_max);
  return dataset.fits_beside_boxes(all, fields);
}

}  // namespace

std::optional<Substitute> stand_in_for(const CompletedView& completed, const DrawnPart& wanted,
                                       const data::Dataset& dataset) {
  if (!may_stand_in(completed, dataset)) return std::nullopt;
  const Shown shown(completed, dataset);
  const std::uint64_t missing = shown.missing_bytes(wanted);
  if (missing == 0) return std::nullopt;
  for (const std::array<int, 3>& level : dataset.info().stored->levels) {
    if (is_finer(level, wanted.halvings)) continue;
    const bool same = level == wanted.halvings;
    if (!same && !may_merge(completed.view())) break;
    const auto fields = shown.at(level);
    const auto part = shown.resident_part(level, fields);
    if (!part && !shown.is_resident(fields, std::nullopt)) continue;
    return Substitute{{level, part, wanted.wanted}, same ? 0 : missing};
  }
  return std::nullopt;
}

namespace {

// The level that always stands in for what is wanted.
std::optional<std::array<int, 3>> base_level(const CompletedView& completed, const Shown& shown,
                                             const DrawnPart& wanted,
                                             const data::Dataset& dataset) {
  const auto& levels = dataset.info().stored->levels;
  std::optional<std::array<int, 3>> base;
  for (std::size_t n = levels.size(); n > 0 && may_merge(completed.view()); --n) {
    const std::array<int, 3>& level = levels[n - 1];
    if (level == wanted.halvings || is_finer(level, wanted.halvings)) break;
    if (!is_base(shown.at(level), dataset)) break;
    base = level;
  }
  return base;
}

}  // namespace

std::optional<Substitute> base_for(const CompletedView& completed, const DrawnPart& wanted,
                                   const data::Dataset& dataset) {
  if (!may_stand_in(completed, dataset)) return std::nullopt;
  const Shown shown(completed, dataset);
  const std::uint64_t missing = shown.missing_bytes(wanted);
  const auto level = base_level(completed, shown, wanted, dataset);
  if (missing == 0 || !level) return std::nullopt;
  return Substitute{{*level, std::nullopt, wanted.wanted}, missing};
}

std::vector<Needed> loads_of(const CompletedView& completed, const data::Dataset& dataset) {
  std::vector<Needed> out;
  if (!may_stand_in(completed, dataset)) return out;
  const DrawnPart wanted = part_of(completed, dataset);
  const auto add = [&](const std::vector<ShownField>& fields,
                       const std::optional<data::HeldPart>& part) {
    for (const ShownField& one : fields) {
      if (auto how = derivation_of(one, part, dataset)) out.push_back({one.field, std::move(*how)});
    }
  };
  const Shown shown(completed, dataset);
  if (const auto base = base_level(completed, shown, wanted, dataset)) {
    add(shown.at(*base), std::nullopt);
  }
  add(shown.at(wanted.halvings), wanted.held);
  return out;
}

}  // namespace windsplat::scene
