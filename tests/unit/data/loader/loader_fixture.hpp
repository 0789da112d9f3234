// A folder of files and the loaders that read them.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "server/data/loader/loader.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::loader {

class Loader : public testing::Test {
 protected:
  void SetUp() override { set_program(WINDSPLAT_PROGRAM); }
  void TearDown() override { set_program(WINDSPLAT_PROGRAM); }

  static Result<std::unique_ptr<RemoteSource>> open_path(const std::string& path,
                                                         Limits limits = {}) {
    auto location = locate(path);
    if (!location) return location.error();
    return open(std::move(*location), std::move(limits));
  }

  static std::unique_ptr<RemoteSource> opened(const std::string& path, Limits limits = {}) {
    auto source = open_path(path, std::move(limits));
    EXPECT_TRUE(source) << source.error().message;
    return source ? std::move(*source) : nullptr;
  }

  test::Folder folder_;
};

inline void expect_same(const Volume& a, const Volume& b) {
  EXPECT_EQ(a.dims, b.dims);
  EXPECT_EQ(a.components, b.components);
  EXPECT_EQ(a.range, b.range);
  EXPECT_EQ(a.masked, b.masked);
  ASSERT_EQ(a.bytes(), b.bytes());
  EXPECT_EQ(std::memcmp(a.component(0), b.component(0), a.bytes()), 0);
}

}  // namespace windsplat::data::loader
