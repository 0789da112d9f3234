// Error and time of the settings for one scene signature: measurements -> forecasts.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "server/quality/laws.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/view_traits.hpp"

namespace windsplat::quality {

// A measurement of one setting at one viewpoint. Errors are linear RMSE over premultiplied RGBA at
// the size of the view, times are milliseconds of rendering.
struct Measured {
  std::optional<double> error;
  std::optional<double> ms;
};

struct Forecast {
  double error = 0;   // the expected one, geometric mean
  double spread = 0;  // standard deviation of its logarithm
  double ms = 0;
  bool timed = false;     // false: `ms` is only relative to the other settings
  bool measured = false;  // the error was measured at a viewpoint near enough
};
using Forecasts = std::array<Forecast, settings_count>;

// The forecast without measurements: laws fitted to many views of generated data.
Forecast prior(const Kind& kind, const Setting& setting, const Viewpoint& viewpoint);

class NearErrors;

// Measurements of one scene signature; keeps the newest of each setting.
class Table {
 public:
  static constexpr std::size_t measurements_max = 24;  // per setting
  static constexpr std::size_t studies_max = 16;
  static constexpr std::size_t descriptions_max = 64;

  explicit Table(const Kind& kind) : kind_(kind) {}

  void add(std::size_t setting, const Viewpoint& viewpoint, const Measured& measured);
  // The time of a frame, milliseconds of rendering. It is averaged with those of frames near to it
  // and unused where a calibration run measured the setting.
  void add_frame(std::size_t setting, const Viewpoint& viewpoint, double ms);

  // What is seen from a viewpoint became known. Measurements made of this very view before count
  // against what is expected of this content.
  void describe(const Viewpoint& viewpoint);
  // The content of this very view; empty: not described, or too long ago.
  [[nodiscard]] std::optional<Content> content(const Viewpoint& viewpoint) const;
  // The error of a level coarser than would suffice, of this view or the nearest one of which it is
  // known; empty: of none that is near enough.
  [[nodiscard]] std::optional<DetailError> detail(const Viewpoint& viewpoint) const;

  // Forecasts of all settings, without the error of a coarser level than would suffice. Times
  // without measurements are estimated from those with.
  [[nodiscard]] Forecasts forecasts(const Viewpoint& viewpoint) const;
  // The prior corrected by measurements: simple kriging of the logarithms of measured over expected
  // values. Errors correlate with those of other settings too, most if they have the same cause,
  // and more so the nearer the viewpoints are; a constant part belongs to the signature. The spread
  // is the kriging standard deviation. A viewpoint of unknown content has that of the nearest known
  // one, or a typical one, and a wider spread.
  [[nodiscard]] Forecast forecast(std::size_t setting, const Viewpoint& viewpoint) const;

  // Whether a session may try a setting of unknown time: once in many frames of all sessions.
  bool begin_try();

  // Whether a calibration run at this viewpoint would add information; begin and end of one.
  [[nodiscard]] bool wants_study(const Viewpoint& viewpoint) const;
  void begin_study(const Viewpoint& viewpoint);
  void end_study(bool complete);

  // Error of JPEG encoding, linear RMSE. add_encoding takes the quantisation error measured by
  // image::encoding_error; encoding_error adds that of chroma subsampling.
  void add_encoding(int quality, const Viewpoint& viewpoint, double error);
  [[nodiscard]] double encoding_error(int quality, bool full_chroma,
                                      const Viewpoint& viewpoint) const;

 private:
  friend class NearErrors;
  struct Entry {
    Viewpoint viewpoint;
    // Logarithms of measured over expected values.
    std::optional<double> log_error;
    std::optional<double> log_ms;
    bool of_frames = false;  // log_ms is the mean of frames
    double guessed = 0;      // share of the variance of unknown content: 0 if it was known
    Cause cause = Cause::kernel;
    double spread = 1;  // standard deviation of log_error without measurements
  };
  // The viewpoint with the content of the nearest known one, if that of its own view is unknown.
  struct Sight {
    Viewpoint viewpoint;
    double guessed = 0;  // share of the variance of unknown content
  };
  [[nodiscard]] Sight filled(const Viewpoint& viewpoint) const;
  // That of the same view, or the nearest one with known content; null: none.
  [[nodiscard]] const Viewpoint* nearest_known(const Viewpoint& viewpoint) const;
  [[nodiscard]] Forecast forecast_at(std::size_t setting, const Sight& sight,
                                     NearErrors& errors) const;

  Kind kind_;
  std::array<std::deque<Entry>, settings_count> entries_;
  std::deque<Viewpoint> studied_;
  std::deque<Viewpoint> described_;
  bool studying_ = false;
  int frames_since_try_ = 0;
  std::optional<double> encoding_error_;  // at quality 90 and a height of 1
};

}  // namespace windsplat::quality
