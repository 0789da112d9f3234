// Error against time of the settings, for one style of picture: measurements in, forecasts out.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>

#include "server/quality/setting.hpp"
#include "server/quality/view_traits.hpp"

namespace windsplat::quality {

// Of one setting at one sight. Errors are linear RMSE over premultiplied RGBA at the view's size,
// times milliseconds of drawing.
struct Measured {
  std::optional<double> error;
  std::optional<double> ms;
};

struct Forecast {
  double error = 0;   // the expected one, geometric mean
  double spread = 0;  // standard deviation of its logarithm
  double ms = 0;
  bool timed = false;     // else `ms` is only in proportion to the other settings'
  bool measured = false;  // the error was, at a sight so near that a study would tell nothing new
};
using Forecasts = std::array<Forecast, settings_count>;

// What is told of a style that nothing was measured of: laws fitted to many views of the samples.
Forecast prior(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);

// Measurements of one style. The newest of each setting are kept.
class Table {
 public:
  static constexpr std::size_t measurements_max = 24;  // of a setting
  static constexpr std::size_t studies_max = 16;

  explicit Table(const Kind& kind) : kind_(kind) {}

  void add(std::size_t setting, const Viewpoint& viewpoint, const Measured& measured);

  // Of all settings. Times that were not measured are guessed in proportion to those that were.
  [[nodiscard]] Forecasts forecasts(const Viewpoint& viewpoint) const;
  // The prior, and how far from it the nearest measurements were: simple kriging of the logarithms'
  // differences, which correlate by how near sights are, and beyond that by being of one style. The
  // spread is the kriging's own.
  [[nodiscard]] Forecast forecast(std::size_t setting, const Viewpoint& viewpoint) const;

  // A study of all settings at this sight: whether it would tell something new, and that it was
  // begun.
  [[nodiscard]] bool wants_study(const Viewpoint& viewpoint) const;
  void begin_study(const Viewpoint& viewpoint);
  void end_study(bool complete);

  // A JPEG's own error, linear RMSE: as image::encoding_error measures it, of quantisation alone;
  // and what is told, with half the chroma that is lost before it.
  void add_encoding(int quality, const Viewpoint& viewpoint, double error);
  [[nodiscard]] double encoding_error(int quality, bool full_chroma,
                                      const Viewpoint& viewpoint) const;

 private:
  struct Entry {
    Viewpoint viewpoint;
    // Logarithms of what was measured over what was expected.
    std::optional<double> log_error;
    std::optional<double> log_ms;
    bool averaged = false;
  };

  Kind kind_;
  std::array<std::deque<Entry>, settings_count> entries_;
  std::deque<Viewpoint> studied_;
  bool studying_ = false;
  std::optional<double> encoding_error_;  // at quality 90 and a height of 1
};

}  // namespace windsplat::quality
