// Formats by the first bytes of a file, and by the files of a folder, for lists of what can be
// opened; only opening a dataset tells whether it can be drawn.
#pragma once

#include <array>
#include <string_view>

#include "server/data/files/folder_list.hpp"

namespace windsplat::data {

// The format of a file of one dataset by its first bytes; empty: none that is known. head: at most
// 4096 bytes.
std::string_view format_of_head(std::string_view head);

// The same, and cases of OpenFOAM and EnSight, which names tell too.
std::string_view format_of_file(std::string_view head, std::string_view name);

inline constexpr std::array<FolderMark, 5> folder_marks{{{".zgroup", "Zarr"},
                                                         {".zarray", "Zarr"},
                                                         {".zmetadata", "Zarr"},
                                                         {"zarr.json", "Zarr"},
                                                         {"system/controlDict", "OpenFOAM"}}};

}  // namespace windsplat::data
