// Numbers as files store them: bytes of a type and byte order -> float or double. And checked
// products of what headers claim.
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
const char* name_of(Scalar type);  // "int8" ... "float64", as FileVariable::type has it
std::optional<Scalar> scalar_named(std::string_view name);

// `count` numbers, the first at `from`, the next `stride` bytes on.
void decode(Scalar type, bool big_endian, const unsigned char* from, std::size_t stride,
            std::size_t count, float* out);
void decode(Scalar type, bool big_endian, const unsigned char* from, std::size_t stride,
            std::size_t count, double* out);

// Coordinates as a header gives them: evenly spaced, or listed. Those that are only claimed take no
// memory until the data were found to be there.
struct Spaced {
  std::size_t count = 0;
  double first = 0;
  double step = 1;
  std::vector<double> listed;  // if not empty, these
  [[nodiscard]] std::vector<double> coordinates() const;
};

// nullopt where the product exceeds 2^62.
std::optional<std::uint64_t> product(const std::vector<std::uint64_t>& factors);

}  // namespace windsplat::data::bytes
