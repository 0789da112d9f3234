// Conversions have one loop per type and byte order.
#include "server/data/bytes/scalar.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <type_traits>

namespace windsplat::data::bytes {

namespace {

struct Known {
  const char* name;
  std::size_t size;
};
constexpr std::array<Known, 10> known_types{{{"int8", 1},
                                             {"uint8", 1},
                                             {"int16", 2},
                                             {"uint16", 2},
                                             {"int32", 4},
                                             {"uint32", 4},
                                             {"int64", 8},
                                             {"uint64", 8},
                                             {"float32", 4},
                                             {"float64", 8}}};

template <class Stored, bool swapped, class Out>
void convert(const unsigned char* from, std::size_t stride, std::size_t count, Out* out) {
  for (std::size_t i = 0; i < count; ++i, from += stride) {
    std::array<unsigned char, sizeof(Stored)> raw;
    std::memcpy(raw.data(), from, raw.size());
    if constexpr (swapped) std::reverse(raw.begin(), raw.end());
    out[i] = static_cast<Out>(std::bit_cast<Stored>(raw));
  }
}

template <class Stored, class Out>
void convert(bool big_endian, const unsigned char* from, std::size_t stride, std::size_t count,
             Out* out) {
  if (big_endian == (std::endian::native == std::endian::big)) {
    convert<Stored, false>(from, stride, count, out);
  } else {
    convert<Stored, true>(from, stride, count, out);
  }
}

template <class Out>
void convert(Scalar type, bool big_endian, const unsigned char* from, std::size_t stride,
             std::size_t count, Out* out) {
  switch (type) {
    case Scalar::int8:
      return convert<std::int8_t>(big_endian, from, stride, count, out);
    case Scalar::uint8:
      return convert<std::uint8_t>(big_endian, from, stride, count, out);
    case Scalar::int16:
      return convert<std::int16_t>(big_endian, from, stride, count, out);
    case Scalar::uint16:
      return convert<std::uint16_t>(big_endian, from, stride, count, out);
    case Scalar::int32:
      return convert<std::int32_t>(big_endian, from, stride, count, out);
    case Scalar::uint32:
      return convert<std::uint32_t>(big_endian, from, stride, count, out);
    case Scalar::int64:
      return convert<std::int64_t>(big_endian, from, stride, count, out);
    case Scalar::uint64:
      return convert<std::uint64_t>(big_endian, from, stride, count, out);
    case Scalar::float32:
      return convert<float>(big_endian, from, stride, count, out);
    case Scalar::float64:
      return convert<double>(big_endian, from, stride, count, out);
  }
}

}  // namespace

std::size_t size_of(Scalar type) { return known_types.at(static_cast<std::size_t>(type)).size; }

const char* name_of(Scalar type) { return known_types.at(static_cast<std::size_t>(type)).name; }

std::optional<Scalar> scalar_named(std::string_view name) {
  for (std::size_t i = 0; i < known_types.size(); ++i) {
    if (name == known_types.at(i).name) return static_cast<Scalar>(i);
  }
  return std::nullopt;
}

void decode(Scalar type, bool big_endian, const unsigned char* from, std::size_t stride,
            std::size_t count, float* out) {
  convert(type, big_endian, from, stride, count, out);
}

void decode(Scalar type, bool big_endian, const unsigned char* from, std::size_t stride,
            std::size_t count, double* out) {
  convert(type, big_endian, from, stride, count, out);
}

std::vector<double> Spaced::coordinates() const {
  if (!listed.empty()) return listed;
  std::vector<double> out(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = first + static_cast<double>(i) * step;
  return out;
}

std::optional<std::uint64_t> product(const std::vector<std::uint64_t>& factors) {
  constexpr std::uint64_t limit = std::uint64_t{1} << 62;
  if (std::find(factors.begin(), factors.end(), 0U) != factors.end()) return 0;
  std::uint64_t out = 1;
  for (const std::uint64_t factor : factors) {
    if (factor > limit / out) return std::nullopt;
    out *= factor;
  }
  return out;
}

}  // namespace windsplat::data::bytes
