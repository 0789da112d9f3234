// Attributes -> Packing, and its application to one number.
#include "server/data/cf/packing.hpp"

#include <netcdf.h>

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace windsplat::data::cf {

namespace {

struct TypeFill {
  std::string_view type;
  double fill;
  double wrap;  // 2^bits of a signed type
};

constexpr auto type_fills =
    std::to_array<TypeFill>({{"int16", NC_FILL_SHORT, 65536.0},
                             {"uint16", NC_FILL_USHORT, 0},
                             {"int32", NC_FILL_INT, 4294967296.0},
                             {"uint32", NC_FILL_UINT, 0},
                             {"int64", static_cast<double>(NC_FILL_INT64), 0},
                             {"uint64", static_cast<double>(NC_FILL_UINT64), 0},
                             {"float32", static_cast<double>(NC_FILL_FLOAT), 0},
                             {"float64", NC_FILL_DOUBLE, 0}});

// Rounds an attribute of a wider type to the type of the variable, for comparison.
double as_stored(double value, bool is_float32) {
  return is_float32 && std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max())
             ? static_cast<double>(static_cast<float>(value))
             : value;
}

// Formats a number with the digits of single precision.
std::string short_text(double value) {
  std::array<char, 40> out{};
  const auto end =
      std::to_chars(out.data(), out.data() + out.size(), value, std::chars_format::general, 7);
  return {out.data(), end.ptr};
}

// Number of values tested together; if one is masked, they are repeated one by one.
constexpr std::size_t values_at_once = 1024;
// As many as a compiler can keep in vector lanes, each with its own partial result.
constexpr std::size_t lanes = 16;

// Whether no value is masked, or NaN.
bool are_valid(const FloatMask& mask, const float* values, std::size_t count) {
  std::array<int, lanes> masked{};
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    for (std::size_t l = 0; l < lanes; ++l) {
      const float value = values[i + l];
      masked[l] |= (value >= mask.valid_min ? 0 : 1) | (value <= mask.valid_max ? 0 : 1);
    }
  }
  for (; i < count; ++i) {
    masked[0] |= values[i] >= mask.valid_min && values[i] <= mask.valid_max ? 0 : 1;
  }
  for (const float missing : mask.missing) {
    for (i = 0; i + lanes <= count; i += lanes) {
      for (std::size_t l = 0; l < lanes; ++l) masked[l] |= values[i + l] == missing ? 1 : 0;
    }
    for (; i < count; ++i) masked[0] |= values[i] == missing ? 1 : 0;
  }
  return std::all_of(masked.begin(), masked.end(), [](int any) { return any == 0; });
}

void apply_to_each(const FloatMask& mask, float* values, std::size_t count) {
  constexpr float masked_value = std::numeric_limits<float>::quiet_NaN();
  for (const float missing : mask.missing) {
    for (std::size_t i = 0; i < count; ++i) {
      values[i] = values[i] == missing ? masked_value : values[i];
    }
  }
  // NaN compares false and stays NaN.
  for (std::size_t i = 0; i < count; ++i) {
    const bool valid = values[i] >= mask.valid_min && values[i] <= mask.valid_max;
    values[i] = valid ? values[i] : masked_value;
  }
}

}  // namespace

Packing packing_of(const ArrayFile& file, int variable) {
  const FileVariable& info = file.contents().variables.at(static_cast<std::size_t>(variable));
  const bool is_float32 = info.type == "float32";
  const bool is_integer = info.type.find("int") != std::string::npos;
  const auto number = [&](const char* attribute) -> std::optional<double> {
    const auto found = file.numbers(variable, attribute);
    return found.values.empty() ? std::nullopt : std::optional(found.values.front());
  };

  Packing packing;
  packing.packed = info.packed;
  packing.scale = number("scale_factor").value_or(1);
  packing.offset = number("add_offset").value_or(0);
  const auto fill = number("_FillValue");
  if (fill) {
    packing.missing.push_back(as_stored(*fill, is_float32));
  }
  for (const TypeFill& known : type_fills) {
    if (known.type == info.type && !fill) {
      packing.missing.push_back(known.fill);
    }
    if (known.type == info.type && info.is_unsigned) {
      packing.wrap = known.wrap;
    }
  }
  if (info.type == "int8" && info.is_unsigned) {
    packing.wrap = 256;
  }
  for (const double value : file.numbers(variable, "missing_value").values) {
    packing.missing.push_back(as_stored(value, is_float32));
  }

  auto low = file.numbers(variable, "valid_min");
  auto high = file.numbers(variable, "valid_max");
  const auto both = file.numbers(variable, "valid_range");
  if (both.values.size() == 2) {
    low = {{both.values[0]}, both.floating};
    high = {{both.values[1]}, both.floating};
  }
  // Limits apply to stored numbers, except floating-point limits of packed integers, which apply to
  // unpacked values (NetCDF User's Guide, attribute conventions).
  packing.valid_is_unpacked = info.packed && is_integer && (low.floating || high.floating);
  const bool round = is_float32 && !packing.valid_is_unpacked;
  if (!low.values.empty()) {
    packing.valid_min = as_stored(low.values.front(), round);
  }
  if (!high.values.empty()) {
    packing.valid_max = as_stored(high.values.front(), round);
  }
  if (packing.wrap > 0) {
    const auto widen = [&](double& value) { value += value < 0 ? packing.wrap : 0; };
    for (double& value : packing.missing) {
      widen(value);
    }
    if (!packing.valid_is_unpacked && std::isfinite(packing.valid_min)) {
      widen(packing.valid_min);
    }
    if (!packing.valid_is_unpacked && std::isfinite(packing.valid_max)) {
      widen(packing.valid_max);
    }
  }
  return packing;
}

std::string valid_text(const Packing& packing) {
  double low = packing.valid_min;
  double high = packing.valid_max;
  if (packing.packed && !packing.valid_is_unpacked) {
    low = low * packing.scale + packing.offset;
    high = high * packing.scale + packing.offset;
    if (packing.scale < 0) std::swap(low, high);
  }
  if (std::isfinite(low) && std::isfinite(high)) return short_text(low) + " to " + short_text(high);
  if (std::isfinite(low)) return "from " + short_text(low);
  return std::isfinite(high) ? "up to " + short_text(high) : std::string();
}

std::string valid_values_note(const ArrayFile& file, const std::vector<int>& variables) {
  constexpr std::size_t listed_max = 20;
  std::string text;
  std::size_t count = 0;
  for (const int v : variables) {
    const std::string valid = valid_text(packing_of(file, v));
    if (valid.empty() || ++count > listed_max) continue;
    text += text.empty() ? "" : ", ";
    text += in_quotes(file.contents().variables.at(at(v)).name) + " (" + valid + ')';
  }
  if (count == 0) return {};
  if (count > listed_max) text += " and " + std::to_string(count - listed_max) + " more";
  return "values outside the valid range of the file are masked: " + text;
}

double unpack_double(const Packing& packing, double stored) {
  constexpr double masked_value = std::numeric_limits<double>::quiet_NaN();
  if (stored < 0) {
    stored += packing.wrap;
  }
  for (const double missing : packing.missing) {
    if (stored == missing) {
      return masked_value;
    }
  }
  const double value = packing.packed ? stored * packing.scale + packing.offset : stored;
  const double judged = packing.valid_is_unpacked ? value : stored;
  // NaN compares false and is masked.
  return judged >= packing.valid_min && judged <= packing.valid_max ? value : masked_value;
}

float unpack(const Packing& packing, double stored) {
  const double value = unpack_double(packing, stored);
  const bool fits = std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max());
  return fits ? static_cast<float>(value) : std::numeric_limits<float>::quiet_NaN();
}

std::optional<FloatMask> float_mask(const Packing& packing) {
  if (packing.packed || packing.wrap != 0) return std::nullopt;
  FloatMask mask;
  // A missing value that is not representable as float32 masks no sample.
  for (const double missing : packing.missing) {
    const auto rounded = static_cast<float>(missing);
    if (static_cast<double>(rounded) == missing) mask.missing.push_back(rounded);
  }
  // Limits between two floats are rounded inward; limits beyond the range of float have no effect.
  const auto largest = static_cast<double>(std::numeric_limits<float>::max());
  if (std::isnan(packing.valid_min) || std::isnan(packing.valid_max)) return std::nullopt;
  if (packing.valid_min > largest || packing.valid_max < -largest) return std::nullopt;
  if (packing.valid_min > -largest) {
    mask.valid_min = static_cast<float>(packing.valid_min);
    if (static_cast<double>(mask.valid_min) < packing.valid_min) {
      mask.valid_min = std::nextafter(mask.valid_min, std::numeric_limits<float>::infinity());
    }
  }
  if (packing.valid_max < largest) {
    mask.valid_max = static_cast<float>(packing.valid_max);
    if (static_cast<double>(mask.valid_max) > packing.valid_max) {
      mask.valid_max = std::nextafter(mask.valid_max, -std::numeric_limits<float>::infinity());
    }
  }
  return mask;
}

void apply(const FloatMask& mask, float* values, std::size_t count) {
  for (std::size_t from = 0; from < count; from += values_at_once) {
    const std::size_t some = std::min(values_at_once, count - from);
    if (!are_valid(mask, values + from, some)) apply_to_each(mask, values + from, some);
  }
}

}  // namespace windsplat::data::cf
