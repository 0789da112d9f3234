// Reads the inputs of a rule, then computes its field sample by sample.
#include "server/data/derived/source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "server/base/check.hpp"
#include "server/data/cf/units.hpp"
#include "server/data/derived/gradient.hpp"
#include "server/data/derived/lengths.hpp"
#include "server/data/derived/moist_air.hpp"
#include "server/data/derived/rules.hpp"

namespace windsplat::data::derived {

namespace {

constexpr float masked = std::numeric_limits<float>::quiet_NaN();

// NaN outside the range of floats.
float as_float(double value) {
  return std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max())
             ? static_cast<float>(value)
             : masked;
}

class DerivedSource final : public FileSource {
 public:
  explicit DerivedSource(std::unique_ptr<Source> source)
      : source_(std::move(source)),
        file_(dynamic_cast<FileSource*>(source_.get())),
        info_(source_->info()),
        own_(info_.fields.size()),
        rules_(find_rules(info_)) {
    // They are computed as a whole.
    std::erase_if(rules_, [&](const Rule& rule) {
      const std::size_t values = info_.grid.samples() * rule.info.components.size();
      if (values * sizeof(float) <= volume_bytes_max) return false;
      info_.left_out.push_back({rule.info.name, "computed as a whole, of more than 16 GiB a step"});
      return true;
    });
    for (const Rule& rule : rules_) info_.fields.push_back(rule.info);
    source_->on_progress([this](double done) { report_progress(done_ + share_ * done); });
  }

  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  void cancel() override { source_->cancel(); }
  void release() override { source_->release(); }
  [[nodiscard]] std::vector<Companion> companions() const override { return source_->companions(); }

  Result<Volume> read(std::size_t field, std::size_t step) override {
    begin();
    return field < own_ ? source_->read(field, step) : FileSource::read(field, step);
  }

  Result<Volume> read_part(std::size_t field, std::size_t step, const StoredPart& part) override {
    begin();
    return field < own_ ? source_->read_part(field, step, part)
                        : FileSource::read_part(field, step, part);
  }

  Result<void> fill(std::size_t field, std::size_t step, float* out) override {
    WINDSPLAT_CHECK(field < info_.fields.size() && step < info_.steps.size());
    begin();
    if (field < own_) {
      WINDSPLAT_CHECK(file_ != nullptr);
      return file_->fill(field, step, out);
    }
    const Rule& rule = rules_[field - own_];
    const bool of_air =
        rule.quantity == Quantity::temperature || rule.quantity == Quantity::relative_humidity;
    return of_air ? fill_air(rule, step, out) : fill_of_vector(rule, step, out);
  }

  Result<bool> fill_in_parts(std::size_t field, std::size_t step, PartTaker& taker) override {
    WINDSPLAT_CHECK(field < info_.fields.size() && step < info_.steps.size());
    begin();
    if (field >= own_ || file_ == nullptr) return false;
    return file_->fill_in_parts(field, step, taker);
  }

  Result<bool> fill_part(std::size_t field, std::size_t step, const StoredPart& part,
                         float* out) override {
    WINDSPLAT_CHECK(field < info_.fields.size() && step < info_.steps.size());
    begin();
    if (field >= own_ || file_ == nullptr) return false;
    return file_->fill_part(field, step, part, out);
  }

 private:
  void begin() {
    done_ = 0;
    share_ = 1;
  }

  // The values of one of the dataset's own fields, masked in all components at once. `share`: of
  // the progress.
  Result<Samples> values_of(std::size_t field, std::size_t step, double share) {
    share_ = share;
    const std::size_t components = info_.fields[field].components.size();
    Samples values;
    if (file_ != nullptr) {
      values = Samples(info_.grid.samples() * components);
      if (auto done = file_->fill(field, step, values.data()); !done) return done.error();
      mask_volume(values.data(), info_.grid.samples(), static_cast<int>(components));
    } else {
      auto volume = source_->read(field, step);
      if (!volume) return volume.error();
      values = std::move(volume->values);
    }
    done_ += share;
    return values;
  }

  Result<void> fill_of_vector(const Rule& rule, std::size_t step, float* out) {
    const auto vector = values_of(rule.vector, step, rule.heights ? 0.4 : 0.6);
    if (!vector) return vector.error();
    const std::size_t samples = info_.grid.samples();
    VectorField field;
    field.factor = rule.factor;
    const std::size_t components = info_.fields[rule.vector].components.size();
    for (std::size_t c = 0; c < components; ++c) {
      field.component.at(c) = vector->data() + c * samples;
    }
    if (rule.quantity == Quantity::magnitude || rule.quantity == Quantity::horizontal_magnitude) {
      if (rule.quantity == Quantity::horizontal_magnitude) field.component[2] = nullptr;
      for (std::size_t n = 0; n < samples; ++n) out[n] = as_float(glm::length(value(field, n)));
      return {};
    }
    Samples heights;
    if (rule.heights) {
      auto read = values_of(rule.heights->field, step, 0.2);
      if (!read) return read.error();
      heights = std::move(*read);
      const double factor = rule.heights->factor;
      for (std::size_t n = 0; n < samples; ++n) {
        heights[n] = as_float(factor * static_cast<double>(heights.data()[n]));
      }
    }
    fill_of_gradient(rule, field, heights, out);
    return {};
  }

  // The vector at a sample in its unit.
  [[nodiscard]] static glm::dvec3 value(const VectorField& field, std::size_t sample) {
    glm::dvec3 out(0);
    for (int c = 0; c < 3; ++c) {
      const float* values = field.component.at(static_cast<std::size_t>(c));
      if (values == nullptr) continue;
      out[c] = field.factor.at(static_cast<std::size_t>(c)) * static_cast<double>(values[sample]);
    }
    return out;
  }

  void fill_of_gradient(const Rule& rule, VectorField field, const Samples& sample_heights,
                        float* out) const {
    const std::size_t samples = info_.grid.samples();
    Heights heights;
    heights.any = rule.quantity != Quantity::vertical_curl &&
                  rule.quantity != Quantity::horizontal_divergence;
    if (!heights.any) {
      field.component[2] = nullptr;
    } else if (sample_heights.empty()) {
      heights.level = level_heights(info_.grid).value();
    } else {
      heights.sample = sample_heights.data();
    }
    std::fill_n(out, samples * rule.info.components.size(), masked);
    const auto put = [&](const LocalGradient& at) {
      if (rule.quantity == Quantity::curl) {
        const glm::dvec3 curl = at.curl();
        for (int c = 0; c < 3; ++c) {
          out[static_cast<std::size_t>(c) * samples + at.sample] = as_float(curl[c]);
        }
        return;
      }
      out[at.sample] = as_float(scalar_of(rule.quantity, at, field));
    };
    for_gradients(info_.grid, field, heights, put,
                  [&](double done) { report_progress(done_ + (1 - done_) * done); });
  }

  [[nodiscard]] static double scalar_of(Quantity quantity, const LocalGradient& at,
                                        const VectorField& field) {
    switch (quantity) {
      case Quantity::vertical_curl:
        return at.curl().z;
      case Quantity::helicity:
        return glm::dot(value(field, at.sample), at.curl());
      case Quantity::q_criterion: {
        // (|W|^2 - |S|^2) / 2 of the antisymmetric and symmetric parts is -tr(G G) / 2.
        const glm::dmat3 square = at.gradient * at.gradient;
        return -0.5 * (square[0][0] + square[1][1] + square[2][2]);
      }
      default:
        return at.trace();
    }
  }

  Result<void> fill_air(const Rule& rule, std::size_t step, float* out) {
    std::array<Samples, 3> values;
    const std::array<const std::optional<Input>*, 3> inputs{
        rule.temperature ? &rule.temperature : &rule.potential, &rule.pressure, &rule.humidity};
    for (std::size_t n = 0; n < inputs.size(); ++n) {
      if (!*inputs.at(n)) continue;
      auto read = values_of((*inputs.at(n))->field, step, 0.3);
      if (!read) return read.error();
      values.at(n) = std::move(*read);
    }
    const auto in_si = [&](std::size_t n, std::size_t sample) {
      const Input& input = **inputs.at(n);
      return input.factor * static_cast<double>(values.at(n).data()[sample]) + input.offset;
    };
    const Axis& z = info_.grid.axes[2];
    const double level_unit = pascals_in(z.units).value_or(1);
    const std::size_t samples = info_.grid.samples();
    const std::size_t layer = samples / z.coordinates.size();
    for (std::size_t n = 0; n < samples; ++n) {
      const double pascals = rule.pressure ? in_si(1, n) : level_unit * z.coordinates[n / layer];
      const double kelvin = rule.temperature ? in_si(0, n) : temperature_of(in_si(0, n), pascals);
      if (rule.quantity == Quantity::temperature) {
        out[n] = as_float(kelvin);
        continue;
      }
      const double ratio = rule.is_specific ? mixing_ratio_of(in_si(2, n)) : in_si(2, n);
      out[n] = as_float(100 * vapour_pressure(ratio, pascals) / saturation_pressure(kelvin));
    }
    return {};
  }

  std::unique_ptr<Source> source_;
  FileSource* file_;  // source_ if it reads files
  DatasetInfo info_;
  std::size_t own_;  // fields of source_, which come first
  std::vector<Rule> rules_;
  double done_ = 0;   // progress before the present input is read
  double share_ = 1;  // of the progress while it is
};

}  // namespace

std::unique_ptr<FileSource> with_derived_fields(std::unique_ptr<Source> source) {
  return std::make_unique<DerivedSource>(std::move(source));
}

}  // namespace windsplat::data::derived
