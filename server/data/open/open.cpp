// Detects formats by content, whatever the file name, and calls the reader of the format.
#include "server/data/open/open.hpp"

#include <array>
#include <cstring>
#include <exception>
#include <new>
#include <string_view>

#include "server/base/ascii.hpp"
#include "server/data/cf/series.hpp"
#include "server/data/cf/source.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/dx/file.hpp"
#include "server/data/formats/grads/file.hpp"
#include "server/data/formats/grib/open.hpp"
#include "server/data/formats/netcdf/file.hpp"
#include "server/data/formats/nrrd/file.hpp"
#include "server/data/formats/raw/file.hpp"
#include "server/data/formats/vtk/source.hpp"
#include "server/data/formats/zarr/store.hpp"
#include "server/data/model/axis_check.hpp"
#include "server/data/model/source.hpp"

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

// The first bytes of the file, or of the first file of a series; empty if there is none.
Result<std::string> first_bytes(Files& files) {
  if (files.location().members.empty()) return std::string();
  const auto input = files.open(files.location().members.front().name);
  if (!input) return input.error();
  return (*input)->head(4096);
}

template <class File>
SourceResult source_of(const Files& files, Result<std::unique_ptr<File>> file) {
  if (!file) return file.error();
  (*file)->set_stored_bytes(files.opened_bytes());
  return cf::make_source(std::move(*file));
}

template <class File>
Result<std::unique_ptr<cf::ArrayFile>> as_arrays(Result<std::unique_ptr<File>> file) {
  if (!file) return file.error();
  return std::unique_ptr<cf::ArrayFile>(std::move(*file));
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
  for (const ArrayFormat& format : array_formats) {
    if (!format.looks_like(*head)) continue;
    if (auto plain = without_group(*files, name); !plain) return plain.error();
    return format.open(files, std::move(*input));
  }
  if (grib::is_grib(**input)) {
    if (auto plain = without_group(*files, name); !plain) return plain.error();
    return as_arrays(grib::open(std::move(*input)));
  }
  if (raw::is_json(*head)) {
    return (*input)->fault(
        "is JSON, but not a description of raw files, which has \"windsplat\": \"raw\" in its "
        "first 4096 bytes");
  }
  return as_arrays(netcdf::File::open(std::move(*input), files->location().inside));
}

SourceResult open_series(const std::shared_ptr<Files>& files) {
  const auto& members = files->location().members;
  const std::string& pattern = files->location().pattern;
  auto series = cf::SeriesFile::open(
      files->location().stem, members.size(),
      [files](std::size_t m) {
        auto member = open_arrays(files, files->location().members[m].name);
        if (member) (*member)->set_stored_bytes(files->opened_bytes());
        return member;
      },
      pattern.substr(pattern.find_last_of('/') + 1));
  return source_of(*files, std::move(series));
}

SourceResult open_by_content(const std::shared_ptr<Files>& files) {
  const auto head = first_bytes(*files);
  if (!head) return head.error();
  if (vtk::is_vtk(*head)) {
    const auto plain = without_group(*files, files->location().members.front().name);
    return plain ? vtk::open(files) : SourceResult(plain.error());
  }
  if (zarr::is_store(*files)) return source_of(*files, zarr::Store::open(files));
  if (files->location().kind == Location::Kind::folder) {
    return make_error(ErrorKind::bad_data,
                      in_quotes(files->location().stem) + " is a directory, but not a Zarr store");
  }
  if (files->location().kind == Location::Kind::series) return open_series(files);
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
    return source;
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
