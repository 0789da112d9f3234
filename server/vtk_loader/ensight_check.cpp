// Reads a file in blocks, which overlap by the length of the longest mark.
#include "server/vtk_loader/ensight_check.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

namespace windsplat::vtk_loader {

namespace {

constexpr std::size_t block_bytes = std::size_t{1} << 20;
// Each follows "coordinates", "block" or the type of the elements.
constexpr std::array<std::string_view, 2> marks{" undef", " partial"};
constexpr std::size_t overlap = 8;

bool begins_number(char c) { return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.'; }

}  // namespace

Result<void> check_ensight(const data::InputFile& file, std::uint64_t numbers_min) {
  std::uint64_t numbers = 0;
  bool at_begin = true;  // of a line, or in the blanks there
  std::string block;
  for (std::uint64_t from = 0; from < file.size();) {
    const std::size_t kept = std::min(block.size(), overlap);
    block.erase(0, block.size() - kept);
    const auto count =
        static_cast<std::size_t>(std::min<std::uint64_t>(block_bytes, file.size() - from));
    block.resize(kept + count);
    if (auto done = file.read(from, block.data() + kept, count); !done) return done;
    from += count;
    for (const std::string_view mark : marks) {
      if (block.find(mark) != std::string::npos) {
        return file.fault("has values marked as" + std::string(mark) + ", which are not read");
      }
    }
    for (const char c : std::string_view(block).substr(numbers_min > 0 ? kept : block.size())) {
      if (at_begin && begins_number(c)) ++numbers;
      at_begin = c == '\n' || (at_begin && (c == ' ' || c == '\t' || c == '\r'));
    }
  }
  if (numbers < numbers_min) {
    return file.fault("ends early: it has " + std::to_string(numbers) + " lines of numbers of " +
                      std::to_string(numbers_min));
  }
  return {};
}

}  // namespace windsplat::vtk_loader
