// What a picture shows of a line whose axis is known: cues to which end is its head and to which of
// two crossing lines is in front, and rules learnt from them. Nothing here sees a vector or a
// depth.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "server/engine/render.hpp"

namespace windsplat::bench {

// The picture over a background (linear RGB) as 8-bit sRGB, row 0 on top.
class LabPicture {
 public:
  LabPicture(const engine::Image& image, const std::array<float, 3>& background);
  // CIELAB (D65) of the light, bilinear; (0.5, 0.5) is the middle of the first pixel. Beyond the
  // edge: that of the edge.
  [[nodiscard]] std::array<double, 3> at(double x, double y) const;
  // Pixels of this picture to one of a picture 720 pixels high, at least 1.
  [[nodiscard]] double scale() const { return scale_; }

 private:
  int width_, height_;
  double scale_;
  std::vector<std::array<unsigned char, 3>> codes_;
};

struct Axis {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // pixels
};

constexpr std::size_t direction_cues = 12;
constexpr std::size_t depth_cues = 5;

// Lightness and chroma of the quarters of the axis nearer to its second end minus those nearer to
// the first, in three bands of distance from it. Exchanging the ends changes every sign.
std::array<double, direction_cues> direction_of(const LabPicture& picture, const Axis& axis);

// Distance in CIELAB of the last quarter of an axis from its first, both averaged.
double contrast_of(const LabPicture& picture, const Axis& axis);

// How much better `first` continues through a crossing at (x, y) than `second`: by colour, and by
// interruptions beside it. Exchanging the lines changes every sign.
std::array<double, depth_cues> order_of(const LabPicture& picture, const Axis& first,
                                        const Axis& second, double x, double y);

// The linear rule through the origin that fits +1 to the cues of the true sign by least squares.
// Cues are scaled to a length of nearly 1, so that pale lines count as much as bright ones; those
// near the least visible contrast, of 2 units of CIELAB, stay small.
template <std::size_t N>
class Rule {
 public:
  // cues: in the order in which they are true.
  void learn(const std::array<double, N>& found) {
    const std::array<double, N> cues = scaled(found);
    for (std::size_t a = 0; a < N; ++a) {
      mean_[a] += cues[a];
      for (std::size_t b = 0; b < N; ++b) square_[a][b] += cues[a] * cues[b];
    }
    ++count_;
  }

  void fit() {
    std::array<std::array<double, N>, N> m = square_;
    weight_ = mean_;
    constexpr double ridge = 0.01;
    for (std::size_t a = 0; a < N; ++a) m[a][a] += ridge * count_;
    // Gaussian elimination of a positive definite matrix.
    for (std::size_t k = 0; k < N; ++k) {
      for (std::size_t row = k + 1; row < N; ++row) {
        const double f = m[row][k] / m[k][k];
        for (std::size_t c = k; c < N; ++c) m[row][c] -= f * m[k][c];
        weight_[row] -= f * weight_[k];
      }
    }
    for (std::size_t k = N; k-- > 0;) {
      for (std::size_t c = k + 1; c < N; ++c) weight_[k] -= m[k][c] * weight_[c];
      weight_[k] /= m[k][k];
    }
  }

  // 1 if the sign is told rightly, 1/2 if nothing tells it.
  [[nodiscard]] double right(const std::array<double, N>& cues) const {
    double sum = 0;
    for (std::size_t a = 0; a < N; ++a) sum += weight_[a] * cues[a];
    if (sum == 0) return 0.5;
    return sum > 0 ? 1 : 0;
  }

 private:
  static std::array<double, N> scaled(const std::array<double, N>& cues) {
    constexpr double visible = 0.02;
    double square = 0;
    for (const double cue : cues) square += cue * cue;
    std::array<double, N> out = cues;
    for (double& cue : out) cue /= std::sqrt(square) + visible;
    return out;
  }

  std::array<std::array<double, N>, N> square_{};
  std::array<double, N> mean_{}, weight_{};
  double count_ = 0;
};

}  // namespace windsplat::bench
