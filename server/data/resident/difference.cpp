// Handles whose fields are differences: their inputs, keys and sizes.
#include "server/data/derived/difference.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "server/data/resident/dataset_state.hpp"

namespace windsplat::data {

Result<Dataset> Dataset::minus(const Dataset& other, std::optional<std::size_t> step) const {
  const DatasetInfo& subtracted = other.info();
  if (other.state_ != state_) {
    if (auto same = derived::check_same_grid(info(), subtracted); !same) return same.error();
  }
  if (step && *step >= subtracted.steps.size()) {
    return make_error(ErrorKind::invalid, "dataset " + in_quotes(subtracted.id) +
                                              " has steps 0 to " +
                                              std::to_string(subtracted.steps.size() - 1));
  }
  Dataset out = *this;
  out.minus_ = other.state_;
  out.minus_step_ = step;
  return out;
}

std::optional<Dataset::Subtrahend> Dataset::subtrahend() const {
  if (!minus_) return std::nullopt;
  return Subtrahend{{minus_, &minus_->info}, minus_step_};
}

Dataset Dataset::minuend() const {
  Dataset out = *this;
  out.minus_ = nullptr;
  out.minus_step_.reset();
  return out;
}

Dataset Dataset::other() const {
  Dataset out = minuend();
  out.state_ = minus_;
  return out;
}

std::string Dataset::digest() const {
  return minus_ ? info().digest + '-' + minus_->info.digest : info().digest;
}

std::uint64_t Dataset::loading_bytes(const std::string& field) const {
  constexpr std::uint64_t operands_and_result = 3;
  return level_bytes(field, {}) * (minus_ ? operands_and_result : 1);
}

// The number of a dataset in the budget is not used again.
std::string Dataset::name_of_subtrahend() const {
  if (!minus_) return "";
  return "-" + std::to_string(minus_->owner) + "@" +
         (minus_step_ ? std::to_string(*minus_step_) : "") + "/";
}

std::string Dataset::variant_of(const std::string& variant, std::size_t step) const {
  if (!minus_) return variant;
  return "-" + std::to_string(minus_->owner) + "@" + std::to_string(minus_step_.value_or(step)) +
         "/" + variant;
}

Result<std::shared_ptr<const Volume>> Dataset::difference(const std::string& field,
                                                          std::size_t index, std::size_t step) {
  const ResidentKey key{state_->owner, index, step, variant_of("", step)};
  if (manner_ == Manner::resident_only) {
    return state_->had(state_->budget->find_now(key), index, step);
  }
  if (const auto there = state_->budget->find(key)) {
    if (*there && own_) own_->insert((*there)->get());
    return as_volume(*there);
  }
  if (auto same = derived::check_same_field(field, info(), minus_->info); !same) {
    return same.error();
  }
  // Both are referenced, so that neither is evicted before the result is computed from them.
  auto from = minuend().volume(field, step);
  if (!from) return from;
  auto minus = other().volume(field, minus_step_.value_or(step));
  if (!minus) return minus;
  const auto made = get(key, (*from)->bytes(), [&] {
    return guarded(state_->info.fields[index],
                   [&]() -> Result<Volume> { return derived::subtract(**from, **minus); });
  });
  for (const auto& operand : {*from, *minus}) {
    if (own_) own_->erase(own_->find(operand.get()));
  }
  return as_volume(made);
}

}  // namespace windsplat::data
