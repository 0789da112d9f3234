// Shortcuts for inspecting a dataset in tests.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <numbers>
#include <string>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"

namespace windsplat::data::test {

inline constexpr double degree = std::numbers::pi / 180;  // in radians

inline std::unique_ptr<Source> opened(const std::string& path) {
  auto source = open_file(path);
  EXPECT_TRUE(source) << (source ? "" : source.error().message);
  return source ? std::move(*source) : nullptr;
}

// The reason why a file is refused.
inline std::string refusal(const std::string& path) {
  const auto source = open_file(path);
  EXPECT_FALSE(source) << path << " was opened";
  if (source) return {};
  EXPECT_EQ(source.error().kind, ErrorKind::bad_data) << source.error().message;
  return source.error().message;
}

inline Volume volume_of(Source& source, const std::string& name, std::size_t step = 0) {
  const FieldInfo* field = source.info().find(name);
  EXPECT_NE(field, nullptr) << name;
  if (field == nullptr) return {};
  auto volume = source.read(static_cast<std::size_t>(field - source.info().fields.data()), step);
  EXPECT_TRUE(volume) << volume.error().message;
  return volume ? std::move(*volume) : Volume();
}

inline bool has_note(const DatasetInfo& info, const std::string& part) {
  for (const std::string& note : info.notes) {
    if (note.find(part) != std::string::npos) return true;
  }
  return false;
}

inline std::string reason_of(const DatasetInfo& info, const std::string& name) {
  for (const LeftOut& left : info.left_out) {
    if (left.name == name) return left.reason;
  }
  return "";
}

}  // namespace windsplat::data::test
