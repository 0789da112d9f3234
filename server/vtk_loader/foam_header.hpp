// The header of a file of an OpenFOAM case, which VTK reads but does not pass on: the class and
// name of its object, its binary layout, and for a field the exponents of its dimensions
// (https://doc.openfoam.com, "Input/output file format" and "Dimensional units").
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/data/files/input_file.hpp"

namespace windsplat::vtk_loader {

struct FoamHeader {
  std::string class_name;  // "volVectorField"
  std::string object;      // "U", by which VTK names the field; empty: absent
  bool is_binary = false;
  std::string arch;                  // of binary data: "LSB;label=32;scalar=64"; empty: absent
  std::optional<std::string> units;  // "m s-1", "1"; nullopt: absent, or not in numbers
};

// What VTK would read wrongly, as it takes the bytes of any binary file for little-endian ones and
// the numbers for 32 or 64 bits; nullopt: nothing.
std::optional<std::string> unread_layout_of(const FoamHeader& header);

// Of a file that may be compressed by gzip. Errors: bad_data, if it has no header.
Result<FoamHeader> foam_header_of(const data::InputFile& file);

// The same of the beginning of its text; nullopt: it has no header.
std::optional<FoamHeader> parse_foam_header(std::string_view text);

}  // namespace windsplat::vtk_loader
