// The tables of recently used scene signatures, shared by all sessions. Thread-safe.
#pragma once

#include <cstdint>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "server/quality/table.hpp"
#include "server/quality/view_traits.hpp"

namespace windsplat::quality {

class Tables {
 public:
  static constexpr std::size_t styles_max = 64;  // scene signatures; the least recently used are
                                                 // evicted first

  // A signature without a key yields the prior of its kind, and nothing is stored for it.
  Forecasts forecasts(const SceneSignature& signature, const Viewpoint& viewpoint);
  Forecast forecast(const SceneSignature& signature, const Setting& setting,
                    const Viewpoint& viewpoint);
  void add(const SceneSignature& signature, std::size_t setting, const Viewpoint& viewpoint,
           const Measured& measured);

  // See Table::describe, Table::content and Table::detail.
  void describe(const SceneSignature& signature, const Viewpoint& viewpoint);
  std::optional<Content> content(const SceneSignature& signature, const Viewpoint& viewpoint);
  std::optional<DetailError> detail(const SceneSignature& signature, const Viewpoint& viewpoint);

  // The time of a frame of a session, see Table::add_frame.
  void add_frame(const SceneSignature& signature, std::size_t setting, const Viewpoint& viewpoint,
                 double ms);

  // See Table::begin_try; false without measurements.
  bool begin_try(const SceneSignature& signature);

  // True if a calibration run at this viewpoint is due and none is in progress. The caller must
  // then run it and call end_study().
  bool begin_study(const SceneSignature& signature, const Viewpoint& viewpoint);
  void end_study(const SceneSignature& signature, bool complete);

  // Removes the tables of a dataset whose data changed.
  void forget(const std::string& dataset);

  void add_encoding(const SceneSignature& signature, int quality, const Viewpoint& viewpoint,
                    double error);
  double encoding_error(const SceneSignature& signature, int quality, bool full_chroma,
                        const Viewpoint& viewpoint);

 private:
  // Require the mutex. Only table_of creates tables, so that queries evict none.
  Table& table_of(const SceneSignature& signature);
  [[nodiscard]] const Table* find(const SceneSignature& signature);

  std::mutex mutex_;
  std::list<std::pair<SceneSignature, Table>> tables_;  // most recently used first
};

}  // namespace windsplat::quality
