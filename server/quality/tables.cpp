// Styles by their keys, the least recently used forgotten.
#include "server/quality/tables.hpp"

#include <algorithm>

namespace windsplat::quality {

Table& Tables::table_of(const Style& style) {
  if (find(style) == nullptr) {
    tables_.emplace_front(style, Table(style.kind));
    if (tables_.size() > styles_max) tables_.pop_back();
  }
  return tables_.front().second;
}

// In front then.
const Table* Tables::find(const Style& style) {
  const auto known = std::find_if(tables_.begin(), tables_.end(),
                                  [&](const auto& kept) { return kept.first.key == style.key; });
  if (known == tables_.end()) return nullptr;
  tables_.splice(tables_.begin(), tables_, known);
  return &known->second;
}

void Tables::forget(const std::string& dataset) {
  const std::lock_guard lock(mutex_);
  tables_.remove_if([&](const auto& kept) { return kept.first.dataset == dataset; });
}

Forecasts Tables::forecasts(const Style& style, const Sight& sight) {
  const std::lock_guard lock(mutex_);
  const Table* const known = style.key.empty() ? nullptr : find(style);
  return known != nullptr ? known->forecasts(sight) : Table(style.kind).forecasts(sight);
}

Forecast Tables::forecast(const Style& style, std::size_t setting, const Sight& sight) {
  const std::lock_guard lock(mutex_);
  const Table* const known = style.key.empty() ? nullptr : find(style);
  return known != nullptr ? known->forecast(setting, sight)
                          : prior(style.kind, settings[setting], sight);
}

void Tables::add(const Style& style, std::size_t setting, const Sight& sight,
                 const Measured& measured) {
  if (style.key.empty()) return;
  const std::lock_guard lock(mutex_);
  table_of(style).add(setting, sight, measured);
}

bool Tables::begin_study(const Style& style, const Sight& sight) {
  if (style.key.empty()) return false;
  const std::lock_guard lock(mutex_);
  Table& table = table_of(style);
  if (!table.wants_study(sight)) return false;
  table.begin_study(sight);
  return true;
}

void Tables::end_study(const Style& style, bool complete) {
  const std::lock_guard lock(mutex_);
  if (find(style) != nullptr) table_of(style).end_study(complete);
}

void Tables::add_encoding(const Style& style, int quality, const Sight& sight, double error) {
  if (style.key.empty()) return;
  const std::lock_guard lock(mutex_);
  table_of(style).add_encoding(quality, sight, error);
}

double Tables::encoding_error(const Style& style, int quality, bool full_chroma,
                              const Sight& sight) {
  const std::lock_guard lock(mutex_);
  const Table* const known = style.key.empty() ? nullptr : find(style);
  return known != nullptr ? known->encoding_error(quality, full_chroma, sight)
                          : Table(style.kind).encoding_error(quality, full_chroma, sight);
}

}  // namespace windsplat::quality
