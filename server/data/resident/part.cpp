// Boxes of fields: when they are read without the rest of a step, and their keys.
#include <algorithm>
#include <optional>
#include <string>

#include "server/data/derived/difference.hpp"
#include "server/data/resident/dataset_state.hpp"
#include "server/data/resident/sizes.hpp"

namespace windsplat::data {

namespace {

// Smaller volumes are read as a whole: the next box then costs nothing.
constexpr std::uint64_t apart_bytes_min = std::uint64_t{4} << 20;
// Of a step, decoded for all boxes of it.
constexpr double apart_share_max = 0.5;

// Adds the box, and the limit that would suffice for it beside a loader that reads the field.
Error with_need_of_box(Error error, const DatasetInfo& info, const FieldInfo& field, const Box& box,
                       std::uint64_t beside, const Budget& budget) {
  if (error.kind != ErrorKind::out_of_memory) return error;
  const auto size = [](const std::array<int, 3>& n) {
    return std::to_string(n[0]) + " x " + std::to_string(n[1]) + " x " + std::to_string(n[2]);
  };
  error.message = "a box of " + size(box.count) + " samples, in chunks of " +
                  size(field.box_chunk) + ", cannot be read: " + error.message;
  const std::uint64_t all =
      bytes_of_box(field, box) + (info.stored_bytes > 0 ? reading_box_bytes(field) : 0) + beside;
  if (all > budget.bytes_max() && budget.name().raised) {
    error.message += "; " + budget.name().raised(all) + " would suffice";
  }
  return error;
}

}  // namespace

bool Dataset::reads_apart(const std::string& field, std::size_t step, const std::vector<Box>& boxes,
                          int layer_stride) const {
  const Result<std::size_t> index = state_->find(field, step);
  if (!index || !state_->info.fields[*index].is_read_by_boxes()) return false;
  if (state_->budget->has({state_->owner, *index, step, variant_of("", step)})) return false;
  if (!minus_ && state_->budget->has({state_->owner, *index, step, packed_variant})) return false;
  if (minus_ && (!derived::check_same_field(field, info(), minus_->info) ||
                 !minus_->info.find(field)->is_read_by_boxes())) {
    return false;
  }
  const std::uint64_t reading = state_->bytes_beside(reading_bytes(info(), {field}));
  if (loading_bytes(field) + reading > state_->budget->bytes_max()) return true;
  if (level_bytes(field, {}) < apart_bytes_min) return false;
  const auto decoded = [&](const State& of, std::size_t at) {
    double share = 0;
    {
      const std::lock_guard lock(of.mutex);
      const auto read = of.reads.find({*of.find(field, at), at});
      if (read != of.reads.end()) share = read->second.apart;
    }
    for (const Box& box : boxes) {
      const FieldInfo& about = *of.info.find(field);
      const int apart = layers_apart(box, layer_stride, about, of.info.grid.dims());
      share += decoded_share(box, apart, about, of.info.grid.dims());
    }
    return share;
  };
  return decoded(*state_, step) <= apart_share_max &&
         (!minus_ || decoded(*minus_, minus_step_.value_or(step)) <= apart_share_max);
}

bool Dataset::reads_within_limit(const std::string& field) const {
  const FieldInfo& about = *info().find(field);
  if (is_within_limit(loading_bytes(field))) return true;
  if (!about.is_read_by_boxes()) return false;
  const std::uint64_t bytes =
      bytes_of_box(about, box_around({0, 0, 0}, about, info().grid.dims())) +
      state_->bytes_beside(reading_box_bytes(about));
  return bytes <= state_->budget->bytes_max();
}

bool Dataset::has(const std::string& field, std::size_t step, const Derivation& how) const {
  const auto key = key_of(field, step, how);
  return key && state_->budget->has(*key);
}

std::vector<HeldPart> Dataset::resident_parts(const std::string& field, std::size_t step,
                                              const Derivation& how, const Box& box) const {
  auto key = key_of(field, step, how);
  const std::string ending = data::key_of(box);
  if (!key || !how.variant.ends_with(ending)) return {};
  std::string& variant = std::get<3>(*key);
  variant.resize(variant.size() - ending.size());
  std::vector<HeldPart> out;
  for (const std::string& one : state_->budget->endings_of(*key)) {
    if (const auto there = box_of(one)) out.push_back({*there, nullptr});
    if (auto there = grid_of_key(one)) {
      const Box bounds = there->bounds;
      out.push_back({bounds, std::make_shared<const BoxGrid>(std::move(*there))});
    }
  }
  return out;
}

Result<std::shared_ptr<const Volume>> Dataset::part(const std::string& field, std::size_t step,
                                                    const Box& box) {
  const Result<std::size_t> index = state_->find(field, step);
  if (!index) return index.error();
  const FieldInfo& about = state_->info.fields[*index];
  if (!is_within(box, info().grid.dims()) || !about.is_read_by_boxes()) {
    return make_error(ErrorKind::invalid, "the box " + data::key_of(box) + " of " +
                                              in_quotes(field) + " cannot be read");
  }
  const ResidentKey key{state_->owner, *index, step,
                        variant_of(part_variant + data::key_of(box), step)};
  const StoredPart samples{box};
  if (manner_ == Manner::resident_only) {
    const auto stored = minus_ ? std::nullopt : std::optional(samples);
    return state_->had(state_->budget->find_now(key), *index, step, stored);
  }
  const std::uint64_t bytes = bytes_of_box(about, box);
  if (!minus_) {
    bool was_there = true;
    const auto made = get(key, bytes, [&]() -> Result<Resident> {
      const Resident whole = state_->budget->find_now({state_->owner, *index, step, ""});
      was_there = whole != nullptr;
      if (!whole) return state_->read(*index, step, urgency(), &samples);
      return guarded(about, [&]() -> Result<Volume> {
        return cut(*std::static_pointer_cast<const Volume>(whole), box);
      });
    });
    if (made && was_there) state_->budget->bricks().had(bricks_of(state_->info, *index, samples));
    if (made) return as_volume(made);
    return with_need_of_box(made.error(), info(), about, box, state_->charged.bytes(),
                            *state_->budget);
  }
  if (const auto there = state_->budget->find(key)) {
    if (*there && own_) own_->insert((*there)->get());
    return as_volume(*there);
  }
  if (auto same = derived::check_same_field(field, info(), minus_->info); !same) {
    return same.error();
  }
  auto from = minuend().part(field, step, box);
  if (!from) return from;
  auto minus = other().part(field, minus_step_.value_or(step), box);
  if (!minus) return minus;
  const auto made = get(key, bytes, [&] {
    return guarded(about, [&]() -> Result<Volume> { return derived::subtract(**from, **minus); });
  });
  for (const auto& operand : {*from, *minus}) {
    if (own_) own_->erase(own_->find(operand.get()));
  }
  return as_volume(made);
}

}  // namespace windsplat::data
