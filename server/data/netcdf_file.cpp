// Opening, scanning and reading through the netCDF C library, one caller at a time.
#include "server/data/netcdf_file.hpp"

#include <fcntl.h>
#include <hdf5.h>
#include <netcdf.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <system_error>
#include <utility>

#include "server/data/cf_text.hpp"
#include "server/data/classic_header.hpp"

namespace windsplat::data::netcdf {

namespace {

using cf::in_quotes;

constexpr std::size_t text_max = 4096;      // bytes of a text attribute that are kept
constexpr std::size_t numbers_max = 65536;  // values of a numeric attribute that are read
constexpr int variables_max = 8192;
constexpr std::array<unsigned char, 8> hdf5_signature{0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};

std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}

bool read_exactly(int descriptor, std::uint64_t offset, std::size_t count, unsigned char* out) {
  while (count > 0) {
    const ssize_t got = ::pread(descriptor, out, count, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got <= 0) {
      return false;
    }
    out += got;
    offset += static_cast<std::uint64_t>(got);
    count -= static_cast<std::size_t>(got);
  }
  return true;
}

// A window on the file, so that a header's many small integers do not each cost a system call.
class Window {
 public:
  Window(int descriptor, std::uint64_t file_bytes)
      : descriptor_(descriptor), file_bytes_(file_bytes) {}

  bool read(std::uint64_t offset, std::size_t count, unsigned char* out) {
    if (offset > file_bytes_ || file_bytes_ - offset < count) {
      return false;
    }
    if (offset < begin_ || offset + count > begin_ + bytes_.size()) {
      const std::uint64_t size = std::min<std::uint64_t>(file_bytes_ - offset, 65536);
      bytes_.resize(size);
      begin_ = offset;
      if (!read_exactly(descriptor_, offset, bytes_.size(), bytes_.data())) {
        bytes_.clear();
        return false;
      }
    }
    std::memcpy(out, bytes_.data() + (offset - begin_), count);
    return true;
  }

 private:
  int descriptor_;
  std::uint64_t file_bytes_;
  std::uint64_t begin_ = 0;
  std::vector<unsigned char> bytes_;
};

// The signature may stand behind a user block of 512, 1024, 2048, ... bytes.
bool has_hdf5_signature(int descriptor, std::uint64_t file_bytes) {
  std::array<unsigned char, 8> found{};
  for (std::uint64_t at = 0; at + found.size() <= file_bytes; at = at == 0 ? 512 : at * 2) {
    if (read_exactly(descriptor, at, found.size(), found.data()) && found == hdf5_signature) {
      return true;
    }
  }
  return false;
}

struct TypeName {
  nc_type type;
  const char* name;
};
constexpr auto number_types = std::to_array<TypeName>({{NC_BYTE, "int8"},
                                                       {NC_UBYTE, "uint8"},
                                                       {NC_SHORT, "int16"},
                                                       {NC_USHORT, "uint16"},
                                                       {NC_INT, "int32"},
                                                       {NC_UINT, "uint32"},
                                                       {NC_INT64, "int64"},
                                                       {NC_UINT64, "uint64"},
                                                       {NC_FLOAT, "float32"},
                                                       {NC_DOUBLE, "float64"}});

const char* number_type_name(nc_type type) {
  const auto* at = std::find_if(number_types.begin(), number_types.end(),
                                [type](const TypeName& known) { return known.type == type; });
  return at == number_types.end() ? nullptr : at->name;
}

}  // namespace

LibraryLock::LibraryLock() {
  library_mutex().lock();
  // Files must not choose code to load (open_library makes sure of it), and HDF5 must not write its
  // own account of every missing attribute to stderr, which is a setting of each thread.
  // A file that could not be written (a full disk) stays open in HDF5, and its own clean-up at the
  // end of the process crashes on it; everything here closes what it opens.
  static const bool without_last_words = H5dont_atexit() >= 0;
  static const bool without_plugins = H5PLset_loading_state(0) >= 0;
  thread_local const bool without_noise = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr) >= 0;
  static_cast<void>(without_last_words);
  static_cast<void>(without_plugins);
  static_cast<void>(without_noise);
}
LibraryLock::~LibraryLock() { library_mutex().unlock(); }

Result<std::string> plain_path(const std::string& path, bool for_writing) {
  namespace fs = std::filesystem;
  if (path.empty() || path.find('\0') != std::string::npos) {
    return make_error(ErrorKind::not_found, "no file name is given");
  }
  if (path.find("://") != std::string::npos) {
    return make_error(ErrorKind::bad_data,
                      in_quotes(path) + " is a URL; only local files are opened");
  }
  std::error_code fault;
  fs::path plain = for_writing ? fs::weakly_canonical(path, fault) : fs::canonical(path, fault);
  if (fault) {
    const bool absent =
        fault == std::errc::no_such_file_or_directory || fault == std::errc::not_a_directory;
    return make_error(absent ? ErrorKind::not_found : ErrorKind::bad_data,
                      in_quotes(path) + ": " + (absent ? "no such file" : fault.message()));
  }
  if (!plain.is_absolute()) {
    plain = fs::absolute(plain);
  }
  if (for_writing && !fs::is_directory(plain.parent_path(), fault)) {
    return make_error(ErrorKind::not_found, in_quotes(path) + ": there is no folder " +
                                                in_quotes(plain.parent_path().native()));
  }
  // The library reads directions behind '#' and rewrites '\' in names.
  if (plain.native().find_first_of("#\\") != std::string::npos ||
      plain.native().find("://") != std::string::npos) {
    return make_error(ErrorKind::bad_data,
                      in_quotes(path) + ": a path with '#' or '\\' is not opened");
  }
  return plain.native();
}

Result<std::unique_ptr<File>> File::open(const std::string& path) {
  auto plain = plain_path(path, false);
  if (!plain) {
    return plain.error();
  }
  std::unique_ptr<File> file(new File);
  file->name_ = std::filesystem::path(*plain).filename().native();
  // O_NONBLOCK: opening a pipe must not wait for a writer; the next check refuses it.
  file->descriptor_ = ::open(plain->c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file->descriptor_ < 0) {
    const int reason = errno;
    return make_error(reason == ENOENT ? ErrorKind::not_found : ErrorKind::bad_data,
                      in_quotes(path) + ": " + std::generic_category().message(reason));
  }
  if (auto fine = file->look_before_opening(); !fine) {
    return fine.error();
  }
  if (auto opened = file->open_library(*plain); !opened) {
    return opened.error();
  }
  if (auto scanned = file->scan(); !scanned) {
    return scanned.error();
  }
  return file;
}

File::~File() {
  if (ncid_ >= 0) {
    const LibraryLock lock;
    nc_close(ncid_);
  }
  if (descriptor_ >= 0) {
    ::close(descriptor_);
  }
}

Error File::fault(const std::string& what) const {
  return make_error(ErrorKind::bad_data, in_quotes(name_) + " " + what);
}

File::Stamp File::stamp_of(int descriptor) {
  struct stat status {};
  Stamp stamp;
  if (::fstat(descriptor, &status) == 0) {
    stamp.bytes = static_cast<std::uint64_t>(status.st_size);
    stamp.seconds = status.st_mtim.tv_sec;
    stamp.nanoseconds = status.st_mtim.tv_nsec;
  }
  return stamp;
}

std::string File::identity() const {
  return name_ + '\n' + std::to_string(stamp_.bytes) + '\n' + std::to_string(stamp_.seconds) + '.' +
         std::to_string(stamp_.nanoseconds);
}

Result<void> File::look_before_opening() {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
    return fault(S_ISDIR(status.st_mode) ? "is a directory, not a file" : "is not a regular file");
  }
  stamp_ = stamp_of(descriptor_);
  if (stamp_.bytes == 0) {
    return fault("is empty");
  }
  std::array<unsigned char, 4> magic{};
  const bool long_enough = read_exactly(descriptor_, 0, magic.size(), magic.data());
  const bool cdf = long_enough && magic[0] == 'C' && magic[1] == 'D' && magic[2] == 'F';
  classic_ = cdf && (magic[3] == 1 || magic[3] == 2 || magic[3] == 5);
  if (!classic_) {
    return has_hdf5_signature(descriptor_, stamp_.bytes)
               ? Result<void>()
               : fault("is not a netCDF file: its first bytes are neither CDF nor HDF5");
  }
  Window window(descriptor_, stamp_.bytes);
  const auto expected =
      classic_bytes_expected([&](std::uint64_t offset, std::size_t count,
                                 unsigned char* out) { return window.read(offset, count, out); },
                             stamp_.bytes);
  if (!expected) {
    return fault("is broken: " + expected.error().message);
  }
  if (*expected > stamp_.bytes) {
    return fault("is cut short: it has " + std::to_string(stamp_.bytes) +
                 " bytes, its header says " + std::to_string(*expected));
  }
  return {};
}

Result<void> File::open_library(const std::string& path) {
  const LibraryLock lock;
  unsigned plugins = 1;
  if (H5PLget_loading_state(&plugins) < 0 || plugins != 0) {
    return make_error(ErrorKind::internal, "HDF5 would load plugins that a file names");
  }
  const int status = nc_open(path.c_str(), NC_NOWRITE, &ncid_);
  if (status != NC_NOERR) {
    ncid_ = -1;
    return fault(std::string("cannot be read as netCDF: it is cut short or damaged (") +
                 nc_strerror(status) + ")");
  }
  // The library opened the name, not our descriptor: make sure that both are one file.
  struct stat by_name {};
  struct stat ours {};
  if (::stat(path.c_str(), &by_name) != 0 || ::fstat(descriptor_, &ours) != 0 ||
      by_name.st_ino != ours.st_ino || by_name.st_dev != ours.st_dev) {
    return fault("was replaced while it was being opened");
  }
  int model = 0;
  int mode = 0;
  if (nc_inq_format_extended(ncid_, &model, &mode) != NC_NOERR ||
      model != (classic_ ? NC_FORMATX_NC3 : NC_FORMATX_NC_HDF5)) {
    return fault("is not of the format that its first bytes say");
  }
  return {};
}

std::string File::text(int variable, const char* attribute) const {
  nc_type type = NC_NAT;
  std::size_t length = 0;
  if (nc_inq_att(ncid_, variable, attribute, &type, &length) != NC_NOERR || length == 0 ||
      length > numbers_max) {
    return {};
  }
  std::string out;
  if (type == NC_CHAR) {
    out.resize(length);
    if (nc_get_att_text(ncid_, variable, attribute, out.data()) != NC_NOERR) {
      return {};
    }
  } else if (type == NC_STRING) {
    std::vector<char*> strings(length, nullptr);
    if (nc_get_att_string(ncid_, variable, attribute, strings.data()) != NC_NOERR) {
      return {};
    }
    if (strings[0] != nullptr) {
      out = strings[0];
    }
    nc_free_string(length, strings.data());
  }
  out = out.substr(0, out.find('\0'));
  return std::string(cf::trim(out)).substr(0, text_max);
}

Numbers File::numbers(int variable, const char* attribute) const {
  const LibraryLock lock;
  nc_type type = NC_NAT;
  std::size_t length = 0;
  Numbers out;
  if (nc_inq_att(ncid_, variable, attribute, &type, &length) != NC_NOERR ||
      number_type_name(type) == nullptr || length > numbers_max) {
    return out;
  }
  out.floating = type == NC_FLOAT || type == NC_DOUBLE;
  out.values.resize(length);
  if (nc_get_att_double(ncid_, variable, attribute, out.values.data()) != NC_NOERR) {
    out.values.clear();
  }
  return out;
}

std::vector<std::size_t> File::chunk(int variable) const {
  const std::size_t rank = contents_.variables.at(static_cast<std::size_t>(variable)).dims.size();
  std::vector<std::size_t> lengths(rank, 1);
  const LibraryLock lock;
  int storage = NC_CONTIGUOUS;
  if (rank == 0 || classic_ ||
      nc_inq_var_chunking(ncid_, variable, &storage, lengths.data()) != NC_NOERR ||
      storage != NC_CHUNKED) {
    std::fill(lengths.begin(), lengths.end(), 1);
  }
  return lengths;
}

void File::forget_chunks(int variable) const {
  if (classic_) return;
  const LibraryLock lock;
  std::size_t size = 0;
  std::size_t slots = 0;
  float preemption = 0;
  // To be told the size of its cache, even the same, the library opens the variable anew. Where it
  // refuses, memory is all that is lost.
  if (nc_get_var_chunk_cache(ncid_, variable, &size, &slots, &preemption) == NC_NOERR) {
    nc_set_var_chunk_cache(ncid_, variable, size, slots, preemption);
  }
}

Result<void> File::scan() {
  const LibraryLock lock;
  contents_.title = text(NC_GLOBAL, "title");
  if (auto fine = scan_dimensions(); !fine) {
    return fine;
  }
  if (auto fine = scan_variables(); !fine) {
    return fine;
  }
  scan_groups();
  return {};
}

Result<void> File::scan_dimensions() {
  int count = 0;
  if (nc_inq_dimids(ncid_, &count, nullptr, 0) != NC_NOERR || count < 0) {
    return fault("is damaged: its dimensions cannot be listed");
  }
  dimension_ids_.resize(static_cast<std::size_t>(count));
  std::vector<int> unlimited(static_cast<std::size_t>(count));
  int unlimited_count = 0;
  if (nc_inq_dimids(ncid_, &count, dimension_ids_.data(), 0) != NC_NOERR ||
      nc_inq_unlimdims(ncid_, &unlimited_count, unlimited.data()) != NC_NOERR) {
    return fault("is damaged: its dimensions cannot be listed");
  }
  unlimited.resize(static_cast<std::size_t>(unlimited_count));
  for (const int id : dimension_ids_) {
    std::array<char, NC_MAX_NAME + 1> name{};
    FileDimension dimension;
    if (nc_inq_dim(ncid_, id, name.data(), &dimension.length) != NC_NOERR) {
      return fault("is damaged: a dimension cannot be read");
    }
    dimension.name = name.data();
    dimension.unlimited = std::find(unlimited.begin(), unlimited.end(), id) != unlimited.end();
    contents_.dimensions.push_back(std::move(dimension));
  }
  return {};
}

Result<void> File::scan_variables() {
  int count = 0;
  if (nc_inq_nvars(ncid_, &count) != NC_NOERR || count < 0 || count > variables_max) {
    return fault("is damaged or has more than " + std::to_string(variables_max) + " variables");
  }
  for (int id = 0; id < count; ++id) {
    std::array<char, NC_MAX_NAME + 1> name{};
    nc_type type = NC_NAT;
    int rank = 0;
    std::array<int, NC_MAX_VAR_DIMS> dims{};
    if (nc_inq_var(ncid_, id, name.data(), &type, &rank, dims.data(), nullptr) != NC_NOERR) {
      return fault("is damaged: a variable cannot be read");
    }
    FileVariable variable;
    variable.name = name.data();
    const char* number = number_type_name(type);
    variable.numeric = number != nullptr;
    variable.type = number != nullptr                      ? number
                    : type == NC_CHAR || type == NC_STRING ? "text"
                                                           : "compound";
    for (int d = 0; d < rank; ++d) {
      const auto at = std::find(dimension_ids_.begin(), dimension_ids_.end(),
                                dims.at(static_cast<std::size_t>(d)));
      if (at == dimension_ids_.end()) {
        return fault("is damaged: a variable's dimension does not exist");
      }
      variable.dims.push_back(static_cast<int>(at - dimension_ids_.begin()));
    }
    variable.standard_name = text(id, "standard_name");
    variable.long_name = text(id, "long_name");
    variable.units = text(id, "units");
    variable.axis = text(id, "axis");
    variable.positive = text(id, "positive");
    variable.calendar = text(id, "calendar");
    variable.coordinates = text(id, "coordinates");
    variable.bounds = text(id, "bounds");
    if (variable.bounds.empty()) {
      variable.bounds = text(id, "climatology");
    }
    variable.grid_mapping = text(id, "grid_mapping");
    variable.vector_mark = text(id, "windsplat_vector");
    variable.is_unsigned = cf::lower(text(id, "_Unsigned")) == "true";
    int attribute = 0;
    variable.packed = nc_inq_attid(ncid_, id, "scale_factor", &attribute) == NC_NOERR ||
                      nc_inq_attid(ncid_, id, "add_offset", &attribute) == NC_NOERR;
    contents_.variables.push_back(std::move(variable));
  }
  return {};
}

void File::scan_groups() {
  int count = 0;
  if (nc_inq_grps(ncid_, &count, nullptr) != NC_NOERR || count <= 0) {
    return;
  }
  std::vector<int> ids(static_cast<std::size_t>(count));
  if (nc_inq_grps(ncid_, &count, ids.data()) != NC_NOERR) {
    return;
  }
  for (const int id : ids) {
    std::array<char, NC_MAX_NAME + 1> name{};
    if (nc_inq_grpname(id, name.data()) == NC_NOERR) {
      contents_.groups.emplace_back(name.data());
    }
  }
}

Result<void> File::read(int variable, const std::vector<std::size_t>& start,
                        const std::vector<std::size_t>& count, double* out) const {
  const LibraryLock lock;
  // A file cut while it is open would yield zeros, not an error.
  if (!(stamp_of(descriptor_) == stamp_)) {
    return fault("has changed since it was opened; open it again");
  }
  // A scalar has no extent, but the library still wants a place to look at.
  const std::size_t none = 0;
  const int status = nc_get_vara_double(ncid_, variable, start.empty() ? &none : start.data(),
                                        count.empty() ? &none : count.data(), out);
  if (status != NC_NOERR) {
    const auto& name = contents_.variables.at(static_cast<std::size_t>(variable)).name;
    return fault("is damaged: " + in_quotes(name) + " cannot be read (" + nc_strerror(status) +
                 ")");
  }
  return {};
}

Result<std::vector<double>> File::read_all(int variable) const {
  const auto& dims = contents_.variables.at(static_cast<std::size_t>(variable)).dims;
  std::vector<std::size_t> start(dims.size(), 0);
  std::vector<std::size_t> count;
  std::size_t values = 1;
  for (const int dim : dims) {
    count.push_back(contents_.dimensions.at(static_cast<std::size_t>(dim)).length);
    values *= count.back();
  }
  std::vector<double> out(values);
  if (values > 0) {
    if (auto done = read(variable, start, count, out.data()); !done) {
      return done.error();
    }
  }
  return out;
}

}  // namespace windsplat::data::netcdf
