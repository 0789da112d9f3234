// Name or first bytes -> format of a case -> what reads it, or a refusal with advice.
#include "server/data/open/cases.hpp"

#include <algorithm>

#include "server/base/ascii.hpp"

namespace windsplat::data {

namespace {

CaseOpener& opener() {
  static CaseOpener the_one = nullptr;
  return the_one;
}

std::string name_of(const Location& location) {
  return location.members.empty() ? location.stem : location.members.front().name;
}

constexpr const char* how_to_read =
    ", which only the program windsplat-vtk reads; it is not installed beside windsplat (see "
    "docs/user/formats.md: scripts/setup vtk, before the build). Or ";

}  // namespace

CaseFormat case_named(Files& files) {
  const Location& location = files.location();
  if (location.kind == Location::Kind::folder) {
    const bool is_case = !location.fetched && files.exists("system/controlDict");
    return is_case ? CaseFormat::openfoam : CaseFormat::none;
  }
  if (location.kind != Location::Kind::file) return CaseFormat::none;
  const std::string name = name_of(location);
  const std::string ending = lower(name.substr(std::min(name.size(), name.find_last_of('.'))));
  if (ending == ".foam" || ending == ".openfoam") return CaseFormat::openfoam;
  return ending == ".case" || ending == ".encas" ? CaseFormat::ensight : CaseFormat::none;
}

CaseFormat case_of(Files& files, const Result<std::string>& head) {
  const CaseFormat named = case_named(files);
  if (named == CaseFormat::openfoam) return named;
  if (!head) return CaseFormat::none;
  const std::string text = lower(*head);
  if (text.find("foamfile") != std::string::npos && text.find('{') != std::string::npos) {
    return CaseFormat::openfoam;
  }
  const bool has_words =
      text.find("format") != std::string::npos && text.find("ensight") != std::string::npos;
  const bool is_ensight = has_words && (named == CaseFormat::ensight || text.starts_with("format"));
  return is_ensight ? CaseFormat::ensight : CaseFormat::none;
}

void set_case_opener(CaseOpener wanted) { opener() = wanted; }

Result<std::unique_ptr<FileSource>> open_case(const std::shared_ptr<Files>& files,
                                              CaseFormat format) {
  const std::string name = in_quotes(name_of(files->location()));
  const bool is_named = case_named(*files) == format;
  if (!is_named) {
    return make_error(ErrorKind::bad_data,
                      name + (format == CaseFormat::openfoam
                                  ? " belongs to an OpenFOAM case; open the folder of the case, or "
                                    "a file *.foam in it"
                                  : " is an EnSight case, whose name must end in .case or .encas"));
  }
  if (files->location().fetched) {
    return make_error(ErrorKind::bad_data,
                      name + " is a case of OpenFOAM or EnSight, which is not read from hosts");
  }
  if (opener() != nullptr) return opener()(files, format);
  return make_error(
      ErrorKind::bad_data,
      name + (format == CaseFormat::openfoam ? " is an OpenFOAM case" : " is an EnSight case") +
          how_to_read +
          (format == CaseFormat::openfoam
               ? "convert the case with foamToVTK and open its .vtm or .vtk files"
               : "convert it to VTK files, for example .pvd or .vtm with ParaView"));
}

}  // namespace windsplat::data
