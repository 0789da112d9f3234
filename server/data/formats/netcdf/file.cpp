// Opening through the netCDF C library, one caller at a time.
#include "server/data/formats/netcdf/file.hpp"

#include <hdf5.h>
#include <netcdf.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <system_error>
#include <utility>

#include "server/base/whole_file.hpp"
#include "server/data/formats/netcdf/classic_header.hpp"

namespace windsplat::data::netcdf {

namespace {

constexpr std::array<unsigned char, 8> hdf5_signature{0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};

std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}

// A buffer of the file, to avoid a system call per integer of the header.
class Window {
 public:
  explicit Window(const InputFile& input) : input_(input) {}

  bool read(std::uint64_t offset, std::size_t count, unsigned char* out) {
    if (offset > input_.size() || input_.size() - offset < count) {
      return false;
    }
    if (offset < begin_ || offset + count > begin_ + bytes_.size()) {
      const std::uint64_t size = std::min<std::uint64_t>(input_.size() - offset, 65536);
      bytes_.resize(size);
      begin_ = offset;
      if (!input_.read(offset, bytes_.data(), bytes_.size())) {
        bytes_.clear();
        return false;
      }
    }
    std::memcpy(out, bytes_.data() + (offset - begin_), count);
    return true;
  }

 private:
  const InputFile& input_;
  std::uint64_t begin_ = 0;
  std::vector<unsigned char> bytes_;
};

// The signature may follow a user block of 512, 1024, 2048, ... bytes.
bool has_hdf5_signature(const InputFile& input) {
  std::array<unsigned char, 8> found{};
  for (std::uint64_t at = 0; at + found.size() <= input.size(); at = at == 0 ? 512 : at * 2) {
    if (input.read(at, found.data(), found.size()) && found == hdf5_signature) {
      return true;
    }
  }
  return false;
}

}  // namespace

LibraryLock::LibraryLock() {
  library_mutex().lock();
  // Files must not load plugins (see open_library), and HDF5 must not print every missing attribute
  // to stderr (a setting per thread). After a failed write (full disk) HDF5 keeps the file open,
  // and its exit handler crashes on it; it is disabled, since all handles are closed here.
  static const bool without_last_words = H5dont_atexit() >= 0;
  static const bool without_plugins = H5PLset_loading_state(0) >= 0;
  thread_local const bool without_noise = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr) >= 0;
  static_cast<void>(without_last_words);
  static_cast<void>(without_plugins);
  static_cast<void>(without_noise);
}
LibraryLock::~LibraryLock() { library_mutex().unlock(); }

Result<std::string> writable_path(const std::string& path) {
  namespace fs = std::filesystem;
  if (path.empty() || path.find('\0') != std::string::npos) {
    return make_error(ErrorKind::not_found, "no file name given");
  }
  std::error_code fault;
  fs::path plain = fs::weakly_canonical(end_of_links(path), fault);
  if (fault) {
    return make_error(ErrorKind::bad_data, in_quotes(path) + ": " + fault.message());
  }
  if (!plain.is_absolute()) {
    plain = fs::absolute(plain);
  }
  if (!fs::is_directory(plain.parent_path(), fault)) {
    return make_error(ErrorKind::not_found, in_quotes(path) + ": missing folder " +
                                                in_quotes(plain.parent_path().native()));
  }
  // The complete file is renamed to its name, which would replace a device or pipe.
  const fs::file_status status = fs::status(plain, fault);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    return make_error(ErrorKind::invalid,
                      in_quotes(path) + " is not a regular file, as required by netCDF");
  }
  // The library interprets '#' as the start of mode options and rewrites '\\' in names.
  if (plain.native().find_first_of("#\\") != std::string::npos ||
      path.find("://") != std::string::npos) {
    return make_error(ErrorKind::bad_data,
                      in_quotes(path) + ": output paths must not contain '#', '\\' or '://'");
  }
  return plain.native();
}

Result<std::unique_ptr<File>> File::open(std::shared_ptr<const InputFile> input,
                                         const std::string& group) {
  std::unique_ptr<File> file(new File(std::move(input)));
  if (auto fine = file->look_before_opening(); !fine) {
    return fine.error();
  }
  if (auto opened = file->open_library(); !opened) {
    return opened.error();
  }
  if (auto scanned = file->scan(group); !scanned) {
    return scanned.error();
  }
  return file;
}

File::~File() {
  if (ncid_ >= 0) {
    const LibraryLock lock;
    hdf5_ = Handle();
    nc_close(ncid_);
  }
}

std::string File::format() const {
  if (classic_) return "netCDF classic";
  return netcdf4_ ? "netCDF-4" : "HDF5";
}

Result<void> File::look_before_opening() {
  std::array<unsigned char, 4> magic{};
  const bool long_enough =
      input_->size() >= magic.size() && input_->read(0, magic.data(), magic.size());
  const bool cdf = long_enough && magic[0] == 'C' && magic[1] == 'D' && magic[2] == 'F';
  classic_ = cdf && (magic[3] == 1 || magic[3] == 2 || magic[3] == 5);
  if (!classic_) {
    if (has_hdf5_signature(*input_)) return {};
    constexpr std::array<unsigned char, 4> hdf4{0x0e, 0x03, 0x13, 0x01};
    constexpr std::array<unsigned char, 4> npy{0x93, 'N', 'U', 'M'};
    if (magic == hdf4) return fault("is HDF4, which is not supported; convert it with h4toh5");
    if (magic == npy) {
      return fault("is NPY, which tells no axes: open a description in JSON that names it as raw");
    }
    return fault(
        "is not a netCDF file, nor of another supported format: its first bytes match no known "
        "signature");
  }
  Window window(*input_);
  const auto expected =
      classic_bytes_expected([&](std::uint64_t offset, std::size_t count,
                                 unsigned char* out) { return window.read(offset, count, out); },
                             input_->size());
  if (!expected) {
    return fault("is malformed: " + expected.error().message);
  }
  if (*expected > input_->size()) {
    return fault("is truncated: it has " + std::to_string(input_->size()) +
                 " bytes, its header requires " + std::to_string(*expected));
  }
  return {};
}

Result<void> File::open_library() {
  const LibraryLock lock;
  unsigned plugins = 1;
  if (H5PLget_loading_state(&plugins) < 0 || plugins != 0) {
    return make_error(ErrorKind::internal,
                      "the file requests an HDF5 plugin, which is not allowed");
  }
  if (!classic_) {
    auto storage = scan_storage(*input_);
    if (!storage) return storage.error();
    storage_ = std::move(*storage);
  }
  // Of classic files the library reads so many bytes at a time (8 KiB by default).
  std::size_t buffer_bytes = std::size_t{64} << 10;
  const int status = nc__open(input_->library_path().c_str(), NC_NOWRITE, &buffer_bytes, &ncid_);
  if (status != NC_NOERR) {
    ncid_ = -1;
    return fault(std::string("cannot be read as netCDF: it is truncated or damaged (") +
                 nc_strerror(status) + ")");
  }
  if (!classic_) {
    hdf5_ = open_hdf5(*input_);
    if (!hdf5_) return fault("is opened by the netCDF library but not by the HDF5 library");
    netcdf4_ = H5Aexists(hdf5_.id(), "_NCProperties") > 0;
  }
  int model = 0;
  int mode = 0;
  if (nc_inq_format_extended(ncid_, &model, &mode) != NC_NOERR ||
      model != (classic_ ? NC_FORMATX_NC3 : NC_FORMATX_NC_HDF5)) {
    return fault("has a format that differs from its signature");
  }
  return {};
}

std::string File::identity() const {
  return group_.empty() ? input_->identity() : input_->identity() + '\n' + group_;
}

}  // namespace windsplat::data::netcdf
