// A truth kept in the study's folder: it may have taken minutes. Picture <-> 8-byte numbers.
#pragma once

#include <filesystem>
#include <optional>

#include "server/study/types.hpp"

namespace windsplat::study {

// Empty if there is none, or not of that size.
std::optional<Picture> read_truth(const std::filesystem::path& path, int width, int height);

// Errors: internal.
Result<void> write_truth(const std::filesystem::path& path, const Picture& picture);

}  // namespace windsplat::study
