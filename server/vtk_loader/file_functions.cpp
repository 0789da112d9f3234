// Functions of the C library by which VTK and the C++ library open and look up files by name,
// defined here so that they reach the files of the case only. They take the place of those of libc
// in the whole program; libc itself does not call them.
#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/vtk_loader/case_files.hpp"

namespace windsplat::vtk_loader {

namespace {

CaseFiles*& served() {
  static CaseFiles* the_one = nullptr;
  return the_one;
}

// A folder that is being listed, given out as a DIR.
struct Listing {
  std::vector<std::string> names;
  std::size_t at = 0;
  dirent entry{};
};

std::optional<std::string> name_in_case(const char* path) {
  auto name = path == nullptr || served() == nullptr ? std::nullopt : CaseFiles::name_of(path);
  if (!name) errno = EACCES;
  return name;
}

// A descriptor of the file with an offset of its own at its beginning; -1 with errno.
int descriptor_of(const std::string& name) {
  if (!served()->exists(name)) {
    errno = ENOENT;
    return -1;
  }
  const auto file = served()->open(name);
  if (!file) {
    errno = EACCES;
    return -1;
  }
  const int copy = ::fcntl((*file)->descriptor(), F_DUPFD_CLOEXEC, 0);
  if (copy >= 0) ::lseek(copy, 0, SEEK_SET);
  return copy;
}

std::FILE* open_stream(const char* path, const char* mode) {
  const auto name = name_in_case(path);
  if (!name) return nullptr;
  if (mode == nullptr || mode[0] != 'r' || std::strchr(mode, '+') != nullptr) {
    errno = EACCES;
    return nullptr;
  }
  if (served()->is_folder(*name)) {
    errno = EISDIR;
    return nullptr;
  }
  const int descriptor = descriptor_of(*name);
  return descriptor < 0 ? nullptr : ::fdopen(descriptor, "r");
}

template <class Status>
int look_up(const char* path, Status* out) {
  const auto name = name_in_case(path);
  if (!name) return -1;
  *out = {};
  if (served()->is_folder(*name)) {
    out->st_mode = S_IFDIR | S_IRUSR | S_IXUSR;
    return 0;
  }
  const int descriptor = descriptor_of(*name);
  if (descriptor < 0) return -1;
  struct stat found {};
  const int done = ::fstat(descriptor, &found);
  ::close(descriptor);
  out->st_mode = found.st_mode;
  out->st_size = found.st_size;
  out->st_mtime = found.st_mtime;
  return done;
}

dirent* next_entry(DIR* folder) {
  auto& listing = *reinterpret_cast<Listing*>(folder);
  if (listing.at == listing.names.size()) return nullptr;
  std::string name = listing.names[listing.at++];
  listing.entry = {};
  listing.entry.d_type = DT_REG;
  if (name.ends_with('/')) {
    name.pop_back();
    listing.entry.d_type = DT_DIR;
  }
  const std::size_t bytes = std::min(name.size(), sizeof listing.entry.d_name - 1);
  std::memcpy(listing.entry.d_name, name.data(), bytes);
  return &listing.entry;
}

}  // namespace

void serve(CaseFiles* files) { served() = files; }

}  // namespace windsplat::vtk_loader

namespace vtk_loader = windsplat::vtk_loader;

// The two kinds of each structure are one where files are 64-bit throughout.
static_assert(sizeof(dirent) == sizeof(dirent64) && sizeof(struct stat) == sizeof(struct stat64));

extern "C" {

FILE* fopen(const char* path, const char* mode) { return vtk_loader::open_stream(path, mode); }
FILE* fopen64(const char* path, const char* mode) { return vtk_loader::open_stream(path, mode); }

int stat(const char* path, struct stat* out) __THROW { return vtk_loader::look_up(path, out); }
int lstat(const char* path, struct stat* out) __THROW { return vtk_loader::look_up(path, out); }
int stat64(const char* path, struct stat64* out) __THROW { return vtk_loader::look_up(path, out); }
int lstat64(const char* path, struct stat64* out) __THROW { return vtk_loader::look_up(path, out); }

int access(const char* path, int mode) __THROW {
  const auto name = vtk_loader::name_in_case(path);
  if (!name) return -1;
  const bool may = (mode & W_OK) == 0 && vtk_loader::served()->exists(*name);
  if (!may) errno = (mode & W_OK) != 0 ? EACCES : ENOENT;
  return may ? 0 : -1;
}

DIR* opendir(const char* path) {
  const auto name = vtk_loader::name_in_case(path);
  if (!name) return nullptr;
  auto names = vtk_loader::served()->list_shown(*name);
  if (!names) {
    errno = ENOENT;
    return nullptr;
  }
  return reinterpret_cast<DIR*>(new vtk_loader::Listing{std::move(*names), 0, {}});
}

dirent* readdir(DIR* folder) { return vtk_loader::next_entry(folder); }
dirent64* readdir64(DIR* folder) {
  return reinterpret_cast<dirent64*>(vtk_loader::next_entry(folder));
}

int closedir(DIR* folder) {
  delete reinterpret_cast<vtk_loader::Listing*>(folder);
  return 0;
}

}  // extern "C"
