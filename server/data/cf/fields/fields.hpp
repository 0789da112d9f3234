// Variables on one grid -> fields: vectors composed of their components, then every variable as a
// scalar.
#pragma once

#include <string>
#include <vector>

#include "server/data/cf/contents.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

struct FieldPlan {
  FieldInfo info;
  std::vector<int> variables;   // one per component, indices into FileContents::variables
  std::vector<double> factors;  // one per component: from the variable's unit to that of the field
};

// Whether a variable has a usual name of a component of a velocity, whatever its units: u, va,
// wvel.
bool has_velocity_name(const FileVariable& variable);

// Whether a variable is by its name and units a component of a velocity.
bool is_velocity_component(const FileVariable& variable);

// Which components of velocities were left out, as a note; empty: none. A velocity that is not
// shown, or only in part, must not go unnoticed. shown: variables, one of which may have the name
// of one that was left out of another file.
std::string absent_components_note(const FileContents& contents,
                                   const std::vector<LeftOut>& left_out,
                                   const std::vector<int>& shown);

// variables: those on the chosen grid. vertical: the kind of its z axis (with a depth axis, u and v
// are a current). Components are identified by the attribute of the netCDF writer, then by
// standard_name (eastward_, northward_, upward_...), then by common names (u v w, ua va wap, ugrd
// vgrd, Ex Ey Ez, b_x b_y b_z, ...). They must have the same dimensions in any order, and units
// that can be converted to that of the first; the third may also be a rate of pressure (omega),
// beside which velocities are in m s-1. Adds notes of conversions and of components that are left
// alone.
std::vector<FieldPlan> find_fields(const FileContents& contents, const std::vector<int>& variables,
                                   AxisKind vertical, std::vector<std::string>& notes);

}  // namespace windsplat::data::cf
