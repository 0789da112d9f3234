// The header of a file of an OpenFOAM case, which VTK reads but does not pass on: the class of its
// object, and for a field the exponents of its dimensions
// (https://doc.openfoam.com, "Input/output file format" and "Dimensional units").
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/data/files/input_file.hpp"

namespace windsplat::vtk_loader {

struct FoamHeader {
  std::string class_name;            // "volVectorField"
  std::optional<std::string> units;  // "m s-1", "1"; nullopt: absent, or not in numbers
};

// Of a file that may be compressed by gzip. Errors: bad_data, if it has no header.
Result<FoamHeader> foam_header_of(const data::InputFile& file);

// The same of the beginning of its text; nullopt: it has no header.
std::optional<FoamHeader> parse_foam_header(std::string_view text);

}  // namespace windsplat::vtk_loader
