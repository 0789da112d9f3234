// Path of the real files fetched by scripts/fetch-test-data.
#pragma once

#include <cstdlib>
#include <string>

namespace windsplat::data::test {

inline std::string test_data(const std::string& name) {
  const char* folder = std::getenv("WINDSPLAT_TEST_DATA");
  std::string path = folder != nullptr ? folder : WINDSPLAT_SOURCE_DIR "/build/test-data";
  path += '/';
  path += name;
  return path;
}

}  // namespace windsplat::data::test
