// Least-recently-used cache of tables by scene signature.
#include "server/quality/tables.hpp"

#include <algorithm>

#include "server/quality/sizes.hpp"

namespace windsplat::quality {

Table& Tables::table_of(const SceneSignature& signature) {
  if (find(signature) == nullptr) {
    tables_.emplace_front(signature, Table(signature.kind));
    if (tables_.size() > styles_max) tables_.pop_back();
  }
  return tables_.front().second;
}

// Moves the table found to the front.
const Table* Tables::find(const SceneSignature& signature) {
  const auto known = std::find_if(tables_.begin(), tables_.end(), [&](const auto& kept) {
    return kept.first.key == signature.key;
  });
  if (known == tables_.end()) return nullptr;
  tables_.splice(tables_.begin(), tables_, known);
  return &known->second;
}

void Tables::forget(const std::string& dataset) {
  const std::lock_guard lock(mutex_);
  tables_.remove_if([&](const auto& kept) { return kept.first.dataset == dataset; });
}

Forecasts Tables::forecasts(const SceneSignature& signature, const Viewpoint& viewpoint) {
  const std::lock_guard lock(mutex_);
  const Table* const known = signature.key.empty() ? nullptr : find(signature);
  return known != nullptr ? known->forecasts(viewpoint)
                          : Table(signature.kind).forecasts(viewpoint);
}

Forecast Tables::forecast(const SceneSignature& signature, const Setting& setting,
                          const Viewpoint& viewpoint) {
  const std::lock_guard lock(mutex_);
  const Table* const known = signature.key.empty() ? nullptr : find(signature);
  return forecast_between(setting, [&](std::size_t i) {
    return known != nullptr ? known->forecast(i, viewpoint)
                            : prior(signature.kind, settings[i], viewpoint);
  });
}

void Tables::add(const SceneSignature& signature, std::size_t setting, const Viewpoint& viewpoint,
                 const Measured& measured) {
  if (signature.key.empty()) return;
  const std::lock_guard lock(mutex_);
  table_of(signature).add(setting, viewpoint, measured);
}

void Tables::describe(const SceneSignature& signature, const Viewpoint& viewpoint) {
  if (signature.key.empty()) return;
  const std::lock_guard lock(mutex_);
  table_of(signature).describe(viewpoint);
}

std::optional<Content> Tables::content(const SceneSignature& signature,
                                       const Viewpoint& viewpoint) {
  const std::lock_guard lock(mutex_);
  const Table* const known = signature.key.empty() ? nullptr : find(signature);
  return known != nullptr ? known->content(viewpoint) : std::nullopt;
}

std::optional<DetailError> Tables::detail(const SceneSignature& signature,
                                          const Viewpoint& viewpoint) {
  const std::lock_guard lock(mutex_);
  const Table* const known = signature.key.empty() ? nullptr : find(signature);
  return known != nullptr ? known->detail(viewpoint) : std::nullopt;
}

void Tables::add_frame(const SceneSignature& signature, std::size_t setting,
                       const Viewpoint& viewpoint, double ms) {
  if (signature.key.empty()) return;
  const std::lock_guard lock(mutex_);
  table_of(signature).add_frame(setting, viewpoint, ms);
}

bool Tables::begin_try(const SceneSignature& signature) {
  const std::lock_guard lock(mutex_);
  return find(signature) != nullptr && table_of(signature).begin_try();
}

bool Tables::begin_study(const SceneSignature& signature, const Viewpoint& viewpoint) {
  if (signature.key.empty()) return false;
  const std::lock_guard lock(mutex_);
  Table& table = table_of(signature);
  if (!table.wants_study(viewpoint)) return false;
  table.begin_study(viewpoint);
  return true;
}

void Tables::end_study(const SceneSignature& signature, bool complete) {
  const std::lock_guard lock(mutex_);
  if (find(signature) != nullptr) table_of(signature).end_study(complete);
}

void Tables::add_encoding(const SceneSignature& signature, int quality, const Viewpoint& viewpoint,
                          double error) {
  if (signature.key.empty()) return;
  const std::lock_guard lock(mutex_);
  table_of(signature).add_encoding(quality, viewpoint, error);
}

double Tables::encoding_error(const SceneSignature& signature, int quality, bool full_chroma,
                              const Viewpoint& viewpoint) {
  const std::lock_guard lock(mutex_);
  const Table* const known = signature.key.empty() ? nullptr : find(signature);
  return known != nullptr ? known->encoding_error(quality, full_chroma, viewpoint)
                          : Table(signature.kind).encoding_error(quality, full_chroma, viewpoint);
}

}  // namespace windsplat::quality
