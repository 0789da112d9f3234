// Models the size of moving frames and finds the quality and size that fit the rate of the link.
#include "server/session/pacing/jpeg_rate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace windsplat::session {
namespace {

constexpr double pixels_power = 0.8;
constexpr int quality_step = 5;
constexpr double to_rise = 0.8;      // fraction of the limit that a better quality may use
constexpr double to_coarsen = 1.25;  // tolerated factor above the maximum of pixels
constexpr int slack_frames = 4;
constexpr int level_max = 4;
constexpr int edge_min = 64;  // pixels; levels that make an edge shorter than this are not used

// Scale of libjpeg's tables, 1 at quality 50.
double scale_of(int quality) { return quality < 50 ? 50.0 / quality : 2 - quality / 50.0; }

double relative(int quality, const BytesModel& model) {
  return std::pow(scale_of(quality), -model.scale_power);
}

}  // namespace

void JpegRate::learn(double pixels, int quality, std::size_t bytes, std::size_t text_bytes) {
  text_bytes_ = static_cast<double>(text_bytes);
  const double factor = factor_of(pixels, quality, bytes);
  // Rises at once, falls slowly.
  factor_ = std::max(factor, 0.5 * (factor_ + factor));
}

double JpegRate::factor_of(double pixels, int quality, std::size_t bytes) const {
  const double body = std::max(static_cast<double>(bytes) - model_.head_bytes, 1.0);
  return body / (std::pow(pixels, pixels_power) * relative(quality, model_));
}

double JpegRate::predicted_bytes(double pixels, int quality) const {
  return model_.head_bytes + factor_ * std::pow(pixels, pixels_power) * relative(quality, model_);
}

int JpegRate::choose(double pixels, const Link& link, Micros budget) {
  if (!link.known()) return quality_;
  const auto share = [&](int quality) {  // fraction of the time available
    const double limit = static_cast<double>(quality > quality_usual ? budget / 4 : budget);
    const double bytes = text_bytes_ + predicted_bytes(pixels, quality);
    return static_cast<double>(link.transfer(bytes)) / std::max(limit, 1.0);
  };
  const int before = quality_;
  while (quality_ > quality_least && share(quality_) > 1) quality_ -= quality_step;
  const int better = quality_ + quality_step;
  if (quality_ == before && better <= quality_most && share(better) <= to_rise) quality_ = better;
  return quality_;
}

Micros JpegRate::time_on(const Link& link, double pixels, int quality) const {
  return link.transfer(text_bytes_ + predicted_bytes(pixels, quality));
}

double JpegRate::pixels_max(const Link& link, Micros budget) const {
  if (!link.known()) return std::numeric_limits<double>::infinity();
  const double time_s = 1e-6 * static_cast<double>(std::max(budget, moving_most_us));
  const double bytes = time_s * link.bytes_per_s() - text_bytes_ - model_.head_bytes;
  return std::pow(std::max(bytes, 1.0) / (factor_ * relative(quality_least, model_)),
                  1 / pixels_power);
}

int JpegRate::least_level(int width, int height, const Link& link, Micros budget) {
  const double most = pixels_max(link, budget);
  const auto pixels = [&](int level) {
    return static_cast<double>(width) * static_cast<double>(height) / std::pow(4.0, level);
  };
  const auto has_coarser = [&] {
    return level_ < level_max && (std::min(width, height) >> (level_ + 1)) >= edge_min;
  };
  const int before = level_;
  while (level_ > 0 && (std::min(width, height) >> level_) < edge_min) --level_;
  while (has_coarser() && pixels(level_) > to_coarsen * most) ++level_;
  slack_ = level_ == before && level_ > 0 && pixels(level_ - 1) <= most ? slack_ + 1 : 0;
  if (slack_ >= slack_frames) {
    --level_;
    slack_ = 0;
  }
  return level_;
}

}  // namespace windsplat::session
