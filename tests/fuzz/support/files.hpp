// One input -> the files of a dataset, in memory. A line "#!file NAME" starts a file; the part
// before the first such line is the file to open.
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
  folder,   // the same files as a folder, all with marks
  on_disk,  // given names, one at a time: HDF5 resolves the links of what it opens
};

// `main`: the name of the first file.
std::shared_ptr<windsplat::data::Files> files_of(std::string_view input, std::string main,
                                                 Kept kept = Kept::in_memory);

// The first bytes of the first file.
std::string_view first_file(std::string_view input);

// Opens the dataset and reads its first and last field at its first and last step. Results of a
// reader must pass the checks for loader messages, and every volume must be complete. Small
// datasets are also rendered, and each pixel must be a premultiplied color.
void read_dataset(const std::shared_ptr<windsplat::data::Files>& files);

}  // namespace fuzz
