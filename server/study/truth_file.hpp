// A truth kept in the study's folder: it may have taken minutes. Picture <-> 8-byte numbers.
#pragma once

#include <filesystem>
#include <optional>

#include "server/study/types.hpp"

namespace windsplat::study {

struct KeptTruth {
  Picture picture;
  double seconds = 0;    // that it took
  double tolerance = 0;  // that it was integrated to
};

// Empty if there is none, or it is damaged, not finite, or not of that size or tolerance.
std::optional<KeptTruth> read_truth(const std::filesystem::path& path, int width, int height,
                                    double tolerance);

// Errors: internal.
Result<void> write_truth(const std::filesystem::path& path, const KeptTruth& truth);

}  // namespace windsplat::study
