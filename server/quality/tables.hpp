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
  Forecasts forecasts(const SceneSignature& signature, const Viewpoint& viewpoint);
  Forecast forecast(const SceneSignature& signature, std::size_t setting,
                    const Viewpoint& viewpoint);
  void add(const SceneSignature& signature, std::size_t setting, const Viewpoint& viewpoint,
           const Measured& measured);

  // True once where a study of the style at this sight is wanted and none is under way: the caller
  // then makes it, and says when it has ended.
  bool begin_study(const SceneSignature& signature, const Viewpoint& viewpoint);
  void end_study(const SceneSignature& signature, bool complete);

  // Its data is another now.
  void forget(const std::string& dataset);

  void add_encoding(const SceneSignature& signature, int quality, const Viewpoint& viewpoint,
                    double error);
  double encoding_error(const SceneSignature& signature, int quality, bool full_chroma,
                        const Viewpoint& viewpoint);

 private:
  // Under the mutex. Looking makes no table: what is only looked at pushes none out.
  Table& table_of(const SceneSignature& signature);
  [[nodiscard]] const Table* find(const SceneSignature& signature);

  std::mutex mutex_;
  std::list<std::pair<SceneSignature, Table>> tables_;  // the one used last in front
};

}  // namespace windsplat::quality
