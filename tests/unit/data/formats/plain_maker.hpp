// Small files of plain formats for the tests, written byte by byte.
#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {

inline void write_file(const std::string& path, const std::string& content) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  std::ofstream(path, std::ios::binary) << content;
}

// Numbers of type T as bytes.
template <class T>
std::string packed(const std::vector<double>& values, bool big_endian = false) {
  std::string out;
  for (const double value : values) {
    const auto stored = static_cast<T>(value);
    std::string bytes(sizeof stored, '\0');
    std::memcpy(bytes.data(), &stored, sizeof stored);
    if (big_endian) std::reverse(bytes.begin(), bytes.end());
    out += bytes;
  }
  return out;
}

// 0, 1, 2, ... times `scale`.
inline std::vector<double> counted(std::size_t count, double scale = 1) {
  std::vector<double> out(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = scale * static_cast<double>(i);
  return out;
}

inline std::string gzipped(const std::string& plain) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&stream, plain.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(plain.data()));
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

inline std::vector<float> values_of(Source& source, const std::string& field,
                                    std::size_t step = 0) {
  const Volume volume = volume_of(source, field, step);
  return {volume.values.data(), volume.values.data() + volume.values.size()};
}

inline std::vector<float> floats(const std::vector<double>& values) {
  return {values.begin(), values.end()};
}

}  // namespace windsplat::data::test
