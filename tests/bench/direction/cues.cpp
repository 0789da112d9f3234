#include "tests/bench/direction/cues.hpp"

#include <algorithm>
#include <cmath>

#include "server/scene/colormap.hpp"

namespace windsplat::bench {
namespace {

using Lab = std::array<double, 3>;

Lab lab_of(const std::array<double, 3>& linear) {
  const double x = 0.4124564 * linear[0] + 0.3575761 * linear[1] + 0.1804375 * linear[2];
  const double y = 0.2126729 * linear[0] + 0.7151522 * linear[1] + 0.0721750 * linear[2];
  const double z = 0.0193339 * linear[0] + 0.1191920 * linear[1] + 0.9503041 * linear[2];
  const auto f = [](double t) {
    constexpr double knee = 216.0 / 24389;
    return t > knee ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116;
  };
  const double fx = f(x / 0.95047);
  const double fy = f(y);
  const double fz = f(z / 1.08883);
  return {116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)};
}

// Light of the codes of 8-bit sRGB.
const std::array<float, 256>& lights_of_codes() {
  static const std::array<float, 256> lights = [] {
    std::array<float, 256> out{};
    for (std::size_t n = 0; n < out.size(); ++n) {
      out[n] = scene::linear_from_srgb(static_cast<float>(n) / 255);
    }
    return out;
  }();
  return lights;
}

double chroma(const Lab& lab) { return std::hypot(lab[1], lab[2]); }

double apart(const Lab& a, const Lab& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

Lab mean(const Lab& a, const Lab& b) {
  return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

// Unit vector along an axis, and its length in pixels.
struct Way {
  double x = 0, y = 0, length = 0;
};

Way way_of(const Axis& axis) {
  const double x = axis.x1 - axis.x0;
  const double y = axis.y1 - axis.y0;
  const double length = std::hypot(x, y);
  return {x / length, y / length, length};
}

}  // namespace

LabPicture::LabPicture(const engine::Image& image, const std::array<float, 3>& background)
    : width_(image.width), height_(image.height), scale_(std::max(1.0, image.height / 720.0)) {
  codes_.reserve(image.rgba.size() / 4);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    const float* rgba = image.rgba.data() + i;
    std::array<unsigned char, 3> code{};
    for (std::size_t c = 0; c < 3; ++c) {
      const float light = std::clamp(rgba[c] + (1 - rgba[3]) * background[c], 0.0F, 1.0F);
      if (light > 0) {
        code[c] = static_cast<unsigned char>(std::lround(255 * scene::srgb_from_linear(light)));
      }
    }
    codes_.push_back(code);
  }
}

Lab LabPicture::at(double x, double y) const {
  const double px = std::clamp(x - 0.5, 0.0, width_ - 1.0);
  const double py = std::clamp(y - 0.5, 0.0, height_ - 1.0);
  const int left = std::min(static_cast<int>(px), std::max(width_ - 2, 0));
  const int top = std::min(static_cast<int>(py), std::max(height_ - 2, 0));
  const double fx = px - left;
  const double fy = py - top;
  const auto& lights = lights_of_codes();
  const auto light = [&](int dx, int dy, std::size_t c) {
    const auto column = static_cast<std::size_t>(std::min(left + dx, width_ - 1));
    const auto row = static_cast<std::size_t>(std::min(top + dy, height_ - 1));
    return static_cast<double>(
        lights.at(codes_[row * static_cast<std::size_t>(width_) + column][c]));
  };
  std::array<double, 3> linear{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double upper = (1 - fx) * light(0, 0, c) + fx * light(1, 0, c);
    const double lower = (1 - fx) * light(0, 1, c) + fx * light(1, 1, c);
    linear[c] = (1 - fy) * upper + fy * lower;
  }
  return lab_of(linear);
}

double contrast_of(const LabPicture& picture, const Axis& axis) {
  constexpr int each = 3;  // places in a quarter
  Lab tail{};
  Lab head{};
  for (int k = 0; k < each; ++k) {
    const double w = (k + 0.5) / each / 4;
    const auto at = [&](double along) {
      return picture.at(axis.x0 + along * (axis.x1 - axis.x0),
                        axis.y0 + along * (axis.y1 - axis.y0));
    };
    const Lab a = at(w);
    const Lab b = at(1 - w);
    for (std::size_t c = 0; c < 3; ++c) {
      tail[c] += a[c] / each;
      head[c] += b[c] / each;
    }
  }
  return apart(tail, head);
}

std::array<double, direction_cues> direction_of(const LabPicture& picture, const Axis& axis) {
  constexpr std::array<std::array<double, 2>, 3> bands{{{0.2, 0.6}, {1.1, 1.6}, {2.3, 3.1}}};
  constexpr int each = 3;  // places in a quarter
  const Way way = way_of(axis);
  std::array<double, direction_cues> cues{};
  std::size_t n = 0;
  for (const auto& band : bands) {
    std::array<double, 4> light{};
    std::array<double, 4> tint{};
    for (std::size_t quarter = 0; quarter < 4; ++quarter) {
      for (int k = 0; k < each; ++k) {
        const double along = way.length * (static_cast<double>(quarter) + (k + 0.5) / each) / 4;
        for (const double distance : band) {
          for (const double side : {-distance, distance}) {
            const double aside = side * picture.scale();
            const Lab lab = picture.at(axis.x0 + along * way.x - aside * way.y,
                                       axis.y0 + along * way.y + aside * way.x);
            light[quarter] += lab[0] / (100 * 4 * each);
            tint[quarter] += chroma(lab) / (100 * 4 * each);
          }
        }
      }
    }
    for (const auto& values : {light, tint}) {
      cues[n++] = values[3] - values[0];
      cues[n++] = values[2] - values[1];
    }
  }
  return cues;
}

std::array<double, depth_cues> order_of(const LabPicture& picture, const Axis& first,
                                        const Axis& second, double x, double y) {
  const double near = 2.2 * picture.scale();
  const double far = 5 * picture.scale();
  const Lab middle = picture.at(x, y);
  const auto along = [&](const Axis& axis, double distance) {
    const Way way = way_of(axis);
    return mean(picture.at(x + distance * way.x, y + distance * way.y),
                picture.at(x - distance * way.x, y - distance * way.y));
  };
  struct Seen {
    Lab near{}, far{};
  };
  const Seen a{along(first, near), along(first, far)};
  const Seen b{along(second, near), along(second, far)};
  return {(apart(middle, b.near) - apart(middle, a.near)) / 100,
          (apart(middle, b.far) - apart(middle, a.far)) / 100,
          ((b.far[0] - b.near[0]) - (a.far[0] - a.near[0])) / 100,
          (apart(b.far, b.near) - apart(a.far, a.near)) / 100, (a.near[0] - b.near[0]) / 100};
}

}  // namespace windsplat::bench
