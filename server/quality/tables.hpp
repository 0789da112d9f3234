// The tables of all styles that were looked at lately, shared by every session. Any thread.
#pragma once

#include <cstdint>
#include <list>
#include <mutex>
#include <string>
#include <utility>

#include "server/quality/table.hpp"
#include "server/quality/view_traits.hpp"

namespace windsplat::quality {

class Tables {
 public:
  static constexpr std::size_t styles_max = 64;  // the least recently used one goes first

  // A style without a key has the prior of its kind, and nothing is kept of it.
  Forecasts forecasts(const Style& style, const Sight& sight);
  Forecast forecast(const Style& style, std::size_t setting, const Sight& sight);
  void add(const Style& style, std::size_t setting, const Sight& sight, const Measured& measured);

  // True once where a study of the style at this sight is wanted and none is under way: the caller
  // then makes it, and says when it has ended.
  bool begin_study(const Style& style, const Sight& sight);
  void end_study(const Style& style, bool complete);

  // Its data is another now.
  void forget(const std::string& dataset);

  void add_encoding(const Style& style, int quality, const Sight& sight, double error);
  double encoding_error(const Style& style, int quality, bool full_chroma, const Sight& sight);

 private:
  // Under the mutex. Looking makes no table: what is only looked at pushes none out.
  Table& table_of(const Style& style);
  [[nodiscard]] const Table* find(const Style& style);

  std::mutex mutex_;
  std::list<std::pair<Style, Table>> tables_;  // the one used last in front
};

}  // namespace windsplat::quality
