// A reference stored in the folder of the study, because computing it may take minutes. Picture <->
// doubles.
#pragma once

#include <filesystem>
#include <optional>

#include "server/study/types.hpp"

namespace windsplat::study {

struct KeptTruth {
  Picture picture;
  double seconds = 0;    // time to compute it
  double tolerance = 0;  // tolerance of the integral
};

// nullopt if the file is missing or damaged, not finite, or of a different size or tolerance.
std::optional<KeptTruth> read_truth(const std::filesystem::path& path, int width, int height,
                                    double tolerance);

// Errors: internal.
Result<void> write_truth(const std::filesystem::path& path, const KeptTruth& truth);

}  // namespace windsplat::study
