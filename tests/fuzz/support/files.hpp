// One input -> the files of a dataset, in memory. A line "#!file NAME" begins a file; what comes
// before the first such line is the one that is opened.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "server/data/files/files.hpp"
#include "server/data/model/source.hpp"

namespace fuzz {

inline constexpr std::string_view file_mark = "#!file ";

enum class Kept {
  in_memory,
  folder,   // the same, and all files are behind marks, those of a folder
  on_disk,  // under a name, one at a time: HDF5 resolves the links of what it opens
};

// `main`: what the first file is called.
std::shared_ptr<windsplat::data::Files> files_of(std::string_view input, std::string main,
                                                 Kept kept = Kept::in_memory);

// The first bytes of the first file.
std::string_view first_file(std::string_view input);

// Opens the dataset and reads its first and last field at its first and last step. What a reader
// gives must be what the daemon would believe of a loader, and every volume must be whole. Small
// datasets are drawn too, and each pixel must be a premultiplied color.
void read_dataset(const std::shared_ptr<windsplat::data::Files>& files);

}  // namespace fuzz
