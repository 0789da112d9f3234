// Boxes of fields: when they are read without the rest of a step, and their keys.
#include <algorithm>
#include <string>

#include "server/data/derived/difference.hpp"
#include "server/data/resident/dataset_state.hpp"

namespace windsplat::data {

namespace {

// Smaller volumes are read as a whole: the next box then costs nothing.
constexpr std::uint64_t apart_bytes_min = std::uint64_t{4} << 20;
// Of a step, decoded for the boxes.
constexpr double apart_share_max = 0.5;
// A part counts as so much at least, which bounds the number of keys.
constexpr std::uint64_t part_bytes_min = std::uint64_t{16} << 10;

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
  if (!is_within_limit(loading_bytes(field))) return true;
  if (level_bytes(field, {}) < apart_bytes_min) return false;
  const auto decoded = [&](const DatasetInfo& of) {
    double share = 0;
    for (const Box& box : boxes) {
      share += decoded_share(box, layer_stride, *of.find(field), of.grid.dims());
    }
    return share;
  };
  return std::max(decoded(info()), minus_ ? decoded(minus_->info) : 0) <= apart_share_max;
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
  if (manner_ == Manner::resident_only) {
    const Resident there = state_->budget->find_now(key);
    return there ? as_volume(there) : state_->not_resident(*index, step);
  }
  const std::uint64_t bytes =
      std::max(part_bytes_min, box.samples() * about.components.size() * sizeof(float));
  if (!minus_) {
    return as_volume(get(key, bytes, [&]() -> Result<Resident> {
      const Resident whole = state_->budget->find_now({state_->owner, *index, step, ""});
      if (!whole) return state_->read(*index, step, urgency(), &box);
      return guarded(about, [&]() -> Result<Volume> {
        return cut(*std::static_pointer_cast<const Volume>(whole), box);
      });
    }));
  }
  if (const auto there = state_->budget->find(key)) {
    if (*there && own_) own_->insert((*there)->get());
    return as_volume(*there);
  }
  if (auto same = derived::check_same_field(field, info(), minus_->info); !same) {
    return same.error();
  }
  const auto from = minuend().part(field, step, box);
  if (!from) return from;
  const auto minus = other().part(field, minus_step_.value_or(step), box);
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
