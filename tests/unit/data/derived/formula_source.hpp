// A dataset whose fields are formulas of position, and the derived fields of it.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "server/data/derived/source.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "tests/unit/data/dataset_probe.hpp"

namespace windsplat::data::derived_test {

using test::degree;
using test::volume_of;

using Vec = std::array<double, 3>;
// Components at the sample i, j, k.
using Formula = std::function<Vec(std::size_t i, std::size_t j, std::size_t k)>;

inline Axis axis_of(AxisKind kind, const std::string& units, std::vector<double> at) {
  Axis axis;
  axis.kind = kind;
  axis.units = units;
  axis.coordinates = std::move(at);
  return axis;
}

inline std::vector<double> evenly(double first, double step, std::size_t count) {
  std::vector<double> at(count);
  for (std::size_t n = 0; n < count; ++n) at[n] = first + step * static_cast<double>(n);
  return at;
}

class FormulaSource final : public FileSource {
 public:
  explicit FormulaSource(Grid grid) {
    info_.grid = std::move(grid);
    info_.steps.resize(1);
  }

  void add(const std::string& name, std::vector<std::string> units, Formula formula,
           const std::string& standard_name = "") {
    FieldInfo field;
    field.name = name;
    field.kind = units.size() > 1 ? FieldKind::vector : FieldKind::scalar;
    for (std::size_t c = 0; c < units.size(); ++c) {
      field.components.push_back(name + std::to_string(c));
    }
    field.units = units[0];
    field.component_units = std::move(units);
    field.standard_name = standard_name;
    info_.fields.push_back(field);
    formulas_.push_back(std::move(formula));
  }
  DatasetInfo& change() { return info_; }

  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  Result<void> fill(std::size_t field, std::size_t /*step*/, float* out) override {
    ++reads;
    const auto [nx, ny, nz] = info_.grid.dims();
    std::size_t n = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(nz); ++k) {
      for (std::size_t j = 0; j < static_cast<std::size_t>(ny); ++j) {
        for (std::size_t i = 0; i < static_cast<std::size_t>(nx); ++i, ++n) {
          const Vec value = formulas_[field](i, j, k);
          for (std::size_t c = 0; c < info_.fields[field].components.size(); ++c) {
            out[c * info_.grid.samples() + n] = static_cast<float>(value.at(c));
          }
        }
      }
    }
    return {};
  }

  int reads = 0;

 private:
  DatasetInfo info_;
  std::vector<Formula> formulas_;
};

inline std::unique_ptr<FileSource> derive(std::unique_ptr<FormulaSource> source) {
  return derived::with_derived_fields(std::move(source));
}

// A field of the dataset whose only own one is this vector, named v.
inline Volume derived_of(const Grid& grid, const std::vector<std::string>& units,
                         const Formula& formula, const std::string& name) {
  auto source = std::make_unique<FormulaSource>(grid);
  source->add("v", units, formula);
  return volume_of(*derive(std::move(source)), name);
}

// The largest difference from a formula among samples at least `rim` from the ends of x and y;
// NaN where the volume is masked.
inline double greatest_error(const Volume& volume, const Formula& expected, std::size_t rim = 0) {
  double greatest = 0;
  std::size_t n = 0;
  const auto nx = static_cast<std::size_t>(volume.dims[0]);
  const auto ny = static_cast<std::size_t>(volume.dims[1]);
  for (std::size_t k = 0; k < static_cast<std::size_t>(volume.dims[2]); ++k) {
    for (std::size_t j = 0; j < ny; ++j) {
      for (std::size_t i = 0; i < nx; ++i, ++n) {
        if (i < rim || j < rim || i + rim >= nx || j + rim >= ny) continue;
        const Vec want = expected(i, j, k);
        for (int c = 0; c < volume.components; ++c) {
          const double is = static_cast<double>(volume.component(c)[n]);
          const double error = std::abs(is - want.at(static_cast<std::size_t>(c)));
          if (!(error <= greatest)) greatest = error;
        }
      }
    }
  }
  return greatest;
}

inline Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Local axes on the sphere.
struct OnSphere {
  Vec east, north, up;
  OnSphere(double longitude, double latitude) {
    const double l = longitude * degree;
    const double p = latitude * degree;
    up = {std::cos(p) * std::cos(l), std::cos(p) * std::sin(l), std::sin(p)};
    east = {-std::sin(l), std::cos(l), 0};
    north = cross(up, east);
  }
};

}  // namespace windsplat::data::derived_test
