// Shortcuts for inspecting a dataset in tests.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <string>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data::test {

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
