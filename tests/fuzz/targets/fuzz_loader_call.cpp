// Complete calls to a compromised loader. The input is its turns, separated by lines "#!turn": each
// is the reply to one received message. A turn starts with the kind of message, followed by the
// payload; for 0x80 and above the rest is sent unframed. Memory to fill receives the bytes of the
// turn repeatedly.
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "server/data/files/files.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/loader/messages.hpp"
#include "tests/fuzz/support/check.hpp"

namespace {

using fuzz::expect;
using namespace windsplat::data;

constexpr std::size_t floats_max = std::size_t{1} << 18;

// A folder with the program, its replies, and the file to open.
struct Stage {
  std::filesystem::path folder;
  std::string file;
  Stage() {
    std::string name = (std::filesystem::temp_directory_path() / "windsplat-fuzz-XXXXXX").string();
    expect(::mkdtemp(name.data()) != nullptr, "a folder");
    folder = name;
    file = folder / "some.nc";
    std::ofstream(file) << "never read";
    std::filesystem::create_symlink(WINDSPLAT_HOSTILE_LOADER, folder / "loader");
    loader::set_program(folder / "loader");
  }
  ~Stage() {
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);
  }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;
};

void expect_whole(const Volume& volume, const DatasetInfo& info, std::size_t field) {
  expect(volume.dims == info.grid.dims(), "a volume has its grid's size");
  expect(volume.values.size() == info.grid.samples() * info.fields[field].components.size(),
         "a volume has all its values");
  Volume again = volume;
  expect(measure_volume(again) && again.masked == volume.masked && again.range == volume.range,
         "a volume has correct masks and range");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Stage stage;
  std::ofstream(stage.folder / "loader.in", std::ios::binary) << fuzz::text_of(data, size);
  loader::Limits limits;
  limits.open_time = std::chrono::milliseconds(5000);
  limits.read_time = std::chrono::milliseconds(5000);
  limits.opens_max = 64;
  auto location = locate(stage.file);
  expect(location.has_value(), "the file exists");
  const auto source = loader::open(*location, limits);
  if (!source) {
    expect(!source.error().message.empty(), "an error has a message");
    return 0;
  }
  const DatasetInfo& info = (*source)->info();
  expect(loader::decode_info(loader::encode_info(info)).has_value(),
         "accepted info satisfies the invariants");
  for (const std::size_t field : {std::size_t{0}, info.fields.size() - 1}) {
    if (info.grid.samples() * info.fields[field].components.size() > floats_max) continue;
    const auto volume = (*source)->read(field, info.steps.size() - 1);
    if (volume) {
      expect_whole(*volume, info, field);
    } else {
      expect(!volume.error().message.empty(), "an error has a message");
    }
  }
  return 0;
}
