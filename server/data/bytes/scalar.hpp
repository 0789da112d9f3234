// Converts numbers as stored in files, of any type and byte order, to float or double. Checked
// products of sizes from headers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <vector>

namespace windsplat::data::bytes {

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

std::size_t size_of(Scalar type);
const char* name_of(Scalar type);  // "int8" ... "float64", as in FileVariable::type
std::optional<Scalar> scalar_named(std::string_view name);

// `count` numbers, the first at `from`, spaced by `stride` bytes.
void decode(Scalar type, bool big_endian, const unsigned char* from, std::size_t stride,
            std::size_t count, float* out);
void decode(Scalar type, bool big_endian, const unsigned char* from, std::size_t stride,
            std::size_t count, double* out);

// Coordinates as given by a header: evenly spaced, or listed. Evenly spaced coordinates take no
// memory until the size of the data has been checked.
struct Spaced {
  std::size_t count = 0;
  double first = 0;
  double step = 1;
  std::vector<double> listed;  // used instead of evenly spaced ones if not empty
  [[nodiscard]] std::vector<double> coordinates() const;
};

// nullopt where the product exceeds 2^62.
std::optional<std::uint64_t> product(const std::vector<std::uint64_t>& factors);

}  // namespace windsplat::data::bytes
