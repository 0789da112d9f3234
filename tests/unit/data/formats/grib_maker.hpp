// Makes GRIB messages from the samples of ecCodes, and opens files of them.
#pragma once

#include <eccodes.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/source.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {

class Maker {
 public:
  explicit Maker(const std::string& sample)
      : handle_(codes_grib_handle_new_from_samples(nullptr, sample.c_str())) {
    EXPECT_NE(handle_, nullptr) << sample;
  }
  Maker(const Maker&) = delete;
  Maker& operator=(const Maker&) = delete;
  ~Maker() { codes_handle_delete(handle_); }

  void set(const char* key, long value) {
    EXPECT_EQ(codes_set_long(handle_, key, value), CODES_SUCCESS) << key;
  }
  void set(const char* key, double value) {
    EXPECT_EQ(codes_set_double(handle_, key, value), CODES_SUCCESS) << key;
  }
  void set(const char* key, const std::string& value) {
    std::size_t length = value.size();
    EXPECT_EQ(codes_set_string(handle_, key, value.c_str(), &length), CODES_SUCCESS) << key;
  }
  void values(const std::vector<double>& list) {
    EXPECT_EQ(codes_set_double_array(handle_, "values", list.data(), list.size()), CODES_SUCCESS);
  }
  // 4 columns and 3 rows with one value.
  void fill(double value) {
    set("Ni", 4L);
    set("Nj", 3L);
    set("longitudeOfFirstGridPointInDegrees", 10.0);
    set("longitudeOfLastGridPointInDegrees", 40.0);
    set("latitudeOfFirstGridPointInDegrees", 60.0);
    set("latitudeOfLastGridPointInDegrees", 20.0);
    set("iDirectionIncrementInDegrees", 10.0);
    set("jDirectionIncrementInDegrees", 20.0);
    set("bitsPerValue", 16L);
    values(std::vector<double>(12, value));
  }
  [[nodiscard]] std::string bytes() const {
    const void* data = nullptr;
    std::size_t size = 0;
    EXPECT_EQ(codes_get_message(handle_, &data, &size), CODES_SUCCESS);
    return {static_cast<const char*>(data), size};
  }
  [[nodiscard]] codes_handle* handle() { return handle_; }

 private:
  codes_handle* handle_;
};

class GribFiles : public testing::Test {
 protected:
  std::unique_ptr<Source> open(const std::string& bytes) {
    write_bytes(folder_ / "a.grib", bytes);
    auto source = open_file(folder_ / "a.grib");
    EXPECT_TRUE(source) << source.error().message;
    return source ? std::move(*source) : nullptr;
  }
  std::string fault(const std::string& bytes) {
    write_bytes(folder_ / "a.grib", bytes);
    auto source = open_file(folder_ / "a.grib");
    if (!source) return source.error().message;
    auto volume = (*source)->read(0, 0);
    return volume ? "" : volume.error().message;
  }

  Folder folder_;
};

}  // namespace windsplat::data::test
