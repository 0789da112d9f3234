// Detects formats by content, whatever the file name, and calls the reader of the format.
#include "server/data/open/open.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/common_steps.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/joined.hpp"
#include "server/data/cf/mesh/meshed_file.hpp"
#include "server/data/cf/selected/index_axes.hpp"
#include "server/data/cf/selected/selected_file.hpp"
#include "server/data/cf/series.hpp"
#include "server/data/cf/source.hpp"
#include "server/data/cf/staggered/collocated_file.hpp"
#include "server/data/derived/source.hpp"
#include "server/data/files/files.hpp"
#include "server/data/files/locate_parts.hpp"
#include "server/data/files/pattern.hpp"
#include "server/data/formats/dap/file.hpp"
#include "server/data/formats/dx/file.hpp"
#include "server/data/formats/grads/file.hpp"
#include "server/data/formats/grib/open.hpp"
#include "server/data/formats/list/document.hpp"
#include "server/data/formats/list/listed_files.hpp"
#include "server/data/formats/netcdf/file.hpp"
#include "server/data/formats/nrrd/file.hpp"
#include "server/data/formats/raw/file.hpp"
#include "server/data/formats/vtk/source.hpp"
#include "server/data/formats/zarr/levels/source.hpp"
#include "server/data/formats/zarr/store.hpp"
#include "server/data/model/axis_check.hpp"
#include "server/data/model/source.hpp"
#include "server/data/open/cases.hpp"
#include "server/data/open/content.hpp"

namespace windsplat::data {

namespace {

using SourceResult = Result<std::unique_ptr<FileSource>>;

// Formats of plain arrays, recognised by the first bytes of a file.
struct ArrayFormat {
  bool (*looks_like)(std::string_view head);
  Result<std::unique_ptr<cf::ArrayFile>> (*open)(const std::shared_ptr<Files>& files,
                                                 std::shared_ptr<const InputFile> input);
};
constexpr auto array_formats = std::to_array<ArrayFormat>({
    {nrrd::looks_like, nrrd::open},
    {grads::looks_like, grads::open},
    {raw::looks_like, raw::open},
    {dx::looks_like, dx::open},
});

// The first bytes of the file, or of the first file of a series whose format they tell; those of
// the first file if there is none.
Result<std::string> first_bytes(Files& files) {
  constexpr std::size_t looked_at_max = 64;
  const auto& members = files.location().members;
  if (members.empty()) return std::string();
  Result<std::string> first = std::string();
  for (std::size_t m = 0; m < std::min(members.size(), looked_at_max); ++m) {
    const auto input = files.open(members[m].name);
    auto head = input ? (*input)->head(4096) : Result<std::string>(input.error());
    if (head && !format_of_head(*head).empty()) return head;
    if (m == 0) first = std::move(head);
  }
  return first;
}

SourceResult source_of(const Files& files, Result<std::unique_ptr<cf::ArrayFile>> file,
                       const std::string& title = "") {
  if (!file) return file.error();
  if (auto known = cf::check_selection((*file)->contents(), files.location().selection); !known) {
    return make_error(known.error().kind,
                      in_quotes((*file)->name()) + ": " + known.error().message);
  }
  (*file)->set_stored_bytes(files.opened_bytes());
  auto lattice = cf::meshed(std::move(*file));
  if (!lattice) return lattice.error();
  (*lattice)->set_stored_bytes(files.opened_bytes());
  return cf::make_source(std::move(*lattice), title);
}

// The chosen entries of dimensions besides space and time.
template <class File>
Result<std::unique_ptr<cf::ArrayFile>> chosen_of(const Files& files,
                                                 Result<std::unique_ptr<File>> file) {
  if (!file) return file.error();
  (*file)->set_stored_bytes(files.opened_bytes());  // limits the reading of coordinates
  const std::string name = (*file)->name();
  auto chosen = cf::selected(std::move(*file), files.location().selection);
  if (!chosen)
    return make_error(chosen.error().kind, in_quotes(name) + ": " + chosen.error().message);
  return chosen;
}

template <class File>
Result<std::unique_ptr<cf::ArrayFile>> as_arrays(const Files& files,
                                                 Result<std::unique_ptr<File>> file) {
  auto chosen = chosen_of(files, std::move(file));
  if (!chosen) return chosen.error();
  return cf::collocated(cf::without_index_axes(std::move(*chosen)));
}

// Only netCDF and HDF5 have groups; for other formats a group after '#/' must not be ignored.
Result<void> without_group(const Files& files, const std::string& name) {
  if (files.location().inside.empty()) return {};
  return make_error(ErrorKind::not_found, in_quotes(name) + " has a format without groups: " +
                                              in_quotes("#/" + files.location().inside) +
                                              " does not exist");
}

// Opens a file of arrays by its first bytes.
Result<std::unique_ptr<cf::ArrayFile>> open_arrays(const std::shared_ptr<Files>& files,
                                                   const std::string& name) {
  auto input = files->open(name);
  if (!input) return input.error();
  const auto head = (*input)->head(4096);
  if (!head) return head.error();
  if (list::looks_like(*head)) {
    return (*input)->fault("is a list of files, which cannot be a part of a list or a pattern");
  }
  for (const ArrayFormat& format : array_formats) {
    if (!format.looks_like(*head)) continue;
    if (auto plain = without_group(*files, name); !plain) return plain.error();
    const std::string folder = name.substr(0, name.rfind('/') + 1);
    const std::shared_ptr<Files> beside =
        folder.empty() ? files : std::make_shared<list::FilesBelow>(files, folder);
    return chosen_of(*files, format.open(beside, std::move(*input)));
  }
  if (vtk::is_vtk(*head)) {
    return (*input)->fault("is a VTK file: only files of arrays are listed or joined by variables");
  }
  if (grib::is_grib(**input)) {
    if (auto plain = without_group(*files, name); !plain) return plain.error();
    return as_arrays(*files, grib::open(std::move(*input)));
  }
  if (raw::is_json(*head)) {
    return (*input)->fault(
        "is JSON, but neither a description of raw files nor a list of files, which have "
        "\"windsplat\": \"raw\" or \"files\" in their first 4096 bytes");
  }
  return as_arrays(*files, netcdf::File::open(std::move(*input), files->location().inside));
}

// The levels of a store are those of its level 0 as a whole.
SourceResult open_store(const std::shared_ptr<Files>& files) {
  std::unique_ptr<zarr::LevelStore> levels;
  auto store = zarr::Store::open(files, &levels);
  if (!store) return store.error();
  auto finest = source_of(*files, as_arrays(*files, std::move(store)));
  if (!finest || levels == nullptr || !files->location().selection.empty()) return finest;
  return zarr::with_levels(std::move(*finest), std::move(levels));
}

using ArraysResult = Result<std::unique_ptr<cf::ArrayFile>>;

// Files with the same variables, joined along time.
ArraysResult open_along_time(const std::shared_ptr<Files>& files, std::vector<std::string> members,
                             const std::string& pattern) {
  const std::size_t count = members.size();
  const auto open_member = [files, members = std::move(members)](std::size_t m) {
    auto member = open_arrays(files, members[m]);
    if (member) (*member)->set_stored_bytes(files->opened_bytes());
    return member;
  };
  auto series = cf::SeriesFile::open(files->location().stem, count, open_member, pattern);
  if (!series) return series.error();
  (*series)->set_stored_bytes(files->opened_bytes());
  return std::unique_ptr<cf::ArrayFile>(std::move(*series));
}

// Files with the same variables: one, or several along time.
struct Part {
  std::string pattern;
  std::vector<std::string> members;
};

bool has_time(const FileContents& contents) {
  const auto roles = cf::classify_dimensions(contents);
  return std::any_of(roles.begin(), roles.end(),
                     [](const cf::DimensionRole& one) { return one.role == cf::Role::time; });
}

// Leaves out of all parts the steps of damaged files; a single file with steps becomes a series for
// that. single: per part its file, empty for a series.
Result<void> keep_common_steps(const std::shared_ptr<Files>& files,
                               const std::vector<std::string>& single,
                               std::vector<std::unique_ptr<cf::ArrayFile>>& parts) {
  const bool damaged = std::any_of(parts.begin(), parts.end(),
                                   [](const auto& part) { return !cf::damage_of(*part).empty(); });
  if (!damaged) return {};
  std::vector<cf::SeriesFile*> series;
  for (std::size_t n = 0; n < parts.size(); ++n) {
    if (!single[n].empty() && has_time(parts[n]->contents())) {
      auto file = open_along_time(files, {single[n]}, single[n]);
      if (!file) return file.error();
      parts[n] = std::move(*file);
    }
    if (auto* const one = dynamic_cast<cf::SeriesFile*>(parts[n].get())) series.push_back(one);
  }
  return cf::keep_common_steps(series);
}

// Parts with different variables are joined. `origin` names them in messages.
ArraysResult open_parts(const std::shared_ptr<Files>& files, std::vector<Part> parts,
                        const std::string& origin) {
  std::vector<std::unique_ptr<cf::ArrayFile>> opened;
  std::vector<std::string> single;  // per part: its file, if it is not a series
  const bool joins = parts.size() > 1;
  for (Part& part : parts) {
    if (part.members.empty()) {
      return make_error(ErrorKind::not_found, in_quotes(part.pattern) + ": no file matches");
    }
    const bool one = part.members.size() == 1 && (joins || part.members.front() == part.pattern);
    single.push_back(one ? part.members.front() : "");
    auto file = one ? open_arrays(files, part.members.front())
                    : open_along_time(files, std::move(part.members), part.pattern);
    if (!file) return file.error();
    (*file)->set_stored_bytes(files->opened_bytes());
    opened.push_back(std::move(*file));
  }
  if (!joins) return std::move(opened.front());
  if (auto common = keep_common_steps(files, single, opened); !common) return common.error();
  auto joined = cf::JoinedFile::open(files->location().stem, origin, std::move(opened));
  if (!joined) return joined.error();
  (*joined)->set_stored_bytes(files->opened_bytes());
  return cf::collocated(std::move(*joined));
}

// The files that a pattern matches: along time, and for a list in braces joined by variables.
ArraysResult open_series(const std::shared_ptr<Files>& files) {
  const Location& location = files->location();
  const std::string pattern = location.pattern.substr(location.pattern.find_last_of('/') + 1);
  const std::vector<std::string> alternatives = alternatives_of(pattern);
  std::vector<Part> parts(alternatives.size());
  for (std::size_t n = 0; n < parts.size(); ++n) parts[n].pattern = alternatives[n];
  for (const Location::Member& member : location.members) {
    const int part = alternative_matching(alternatives, member.name);
    if (part >= 0) parts[static_cast<std::size_t>(part)].members.push_back(member.name);
  }
  return open_parts(files, std::move(parts), pattern);
}

// The files that a name or pattern of a list stands for, in natural order.
Result<std::vector<std::string>> files_named(Files& files, const std::string& name) {
  const std::size_t slash = name.find_last_of('/');
  const std::string folder = slash == std::string::npos ? "" : name.substr(0, slash + 1);
  const std::string pattern = name.substr(slash + 1);
  if (!has_wildcard(pattern) || files.exists(name)) return std::vector<std::string>{name};
  if (files.location().fetched) {
    return make_error(ErrorKind::bad_data,
                      in_quotes(name) +
                          " is a pattern, but a host does not list its files: a list "
                          "on a host must name each file");
  }
  const auto entries = files.list(folder.substr(0, folder.size() - (folder.empty() ? 0 : 1)));
  if (!entries) return entries.error();
  std::vector<std::string> out;
  for (const std::string& entry : *entries) {
    if (entry.ends_with('/') || alternative_matching({pattern}, entry) < 0) continue;
    out.push_back(folder);
    out.back() += entry;
    if (out.size() > series_members_max) {
      return make_error(ErrorKind::bad_data, in_quotes(name) + " matches more than " +
                                                 std::to_string(series_members_max) + " files");
    }
  }
  std::sort(out.begin(), out.end(), comes_before);
  return out;
}

// The files of a list, whose entries are parts like the alternatives of a pattern. The entries of
// dimensions and the group of the location take the place of those of the list.
SourceResult open_list(const std::shared_ptr<Files>& files, Result<list::Document> document) {
  if (!document) return document.error();
  Location location = files->location();
  if (location.inside.empty()) location.inside = document->group;
  for (SelectedEntry& entry : document->selection) {
    const bool replaced = std::any_of(
        location.selection.begin(), location.selection.end(),
        [&](const SelectedEntry& chosen) { return chosen.dimension == entry.dimension; });
    if (!replaced) location.selection.push_back(std::move(entry));
  }
  std::string title = document->title;
  if (!title.empty() && !location.selection.empty()) {
    title += " (" + selection_text(location.selection) + ')';
  }
  const std::string origin =
      location.members.empty() ? "list of files" : location.members.front().name;
  const auto listed = std::make_shared<list::ListedFiles>(files, std::move(location));
  std::vector<Part> parts;
  for (const std::string& name : document->files) {
    for (std::string& alternative : alternatives_of(name)) {
      if (parts.size() == list::parts_max) {
        return make_error(ErrorKind::bad_data, in_quotes(origin) + " has more than " +
                                                   std::to_string(list::parts_max) +
                                                   " parts, counting alternatives in braces");
      }
      auto members = files_named(*files, alternative);
      if (!members) return members.error();
      parts.push_back({std::move(alternative), std::move(*members)});
    }
  }
  auto source = source_of(*listed, open_parts(listed, std::move(parts), origin), title);
  listed->stop_counting();
  return source;
}

SourceResult open_by_content(const std::shared_ptr<Files>& files) {
  if (const std::string& text = files->location().list; !text.empty()) {
    return open_list(files, list::parse_document(text));
  }
  if (files->location().service) {
    const std::string& name = files->location().members.front().name;
    if (auto plain = without_group(*files, name); !plain) return plain.error();
    return source_of(*files, as_arrays(*files, dap::open(files)));
  }
  const auto head = first_bytes(*files);
  if (const CaseFormat format = case_of(*files, head); format != CaseFormat::none) {
    return open_case(files, format);
  }
  if (!head) return head.error();
  if (list::looks_like(*head) && files->location().kind == Location::Kind::file) {
    const auto input = files->open(files->location().members.front().name);
    if (!input) return input.error();
    return open_list(files, list::parse_document(**input));
  }
  if (vtk::is_vtk(*head) || (head->starts_with("\x89HDF") && vtk::is_vtkhdf(*files))) {
    const std::string& name = files->location().members.front().name;
    if (!files->location().selection.empty()) {
      return make_error(ErrorKind::not_found,
                        in_quotes(name) + " has a format without dimensions to choose from");
    }
    return vtk::open(files);  // a block may follow '#/'
  }
  if (zarr::is_store(*files)) return open_store(files);
  if (files->location().kind == Location::Kind::folder) {
    return make_error(ErrorKind::bad_data,
                      in_quotes(files->location().stem) +
                          (files->location().fetched
                               ? " has no metadata of a Zarr store"
                               : " is a directory without a Zarr store (no .zgroup, .zarray or "
                                 "zarr.json)"));
  }
  if (files->location().kind == Location::Kind::series) {
    return source_of(*files, open_series(files));
  }
  return source_of(*files, open_arrays(files, files->location().members.front().name));
}

}  // namespace

SourceResult open_dataset(const std::shared_ptr<Files>& files) {
  const std::string shown = in_quotes(files->location().stem);
  try {
    auto source = open_by_content(files);
    if (!source) return source;
    if (const auto ok = check_axes((*source)->info().grid); !ok) {
      return make_error(ErrorKind::bad_data, shown + ": " + ok.error().message);
    }
    files->stop_counting();  // a series or store may open any number of files later
    return derived::with_derived_fields(std::move(*source));
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::out_of_memory, "not enough memory to open " + shown);
  } catch (const std::exception& fault) {
    return make_error(ErrorKind::internal,
                      "opening " + shown + " failed: " + printable(fault.what()));
  }
}

Result<std::unique_ptr<Source>> open_file(const std::string& path) {
  auto location = locate(path);
  if (!location) return location.error();
  auto source = open_dataset(direct_files(std::move(*location)));
  if (!source) return source.error();
  return std::unique_ptr<Source>(std::move(*source));
}

}  // namespace windsplat::data
