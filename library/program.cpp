// Finds the installed program, from the place of this library.
#include <dlfcn.h>
#include <unistd.h>

#include <filesystem>
#include <mutex>
#include <system_error>

#include "library/state.hpp"
#include "server/data/loader/loader.hpp"

namespace windsplat {
namespace {

struct Chosen {
  std::mutex mutex;
  std::string path;  // empty: beside the library
};

Chosen& chosen() {
  static Chosen one;
  return one;
}

bool is_executable(const std::string& path) { return ::access(path.c_str(), X_OK) == 0; }

// The library is in PREFIX/lib or PREFIX/lib/ARCHITECTURE; empty if there is no such program.
std::string beside_the_library() {
  Dl_info found{};
  if (::dladdr(reinterpret_cast<const void*>(&beside_the_library), &found) == 0) return {};
  std::error_code fault;
  std::filesystem::path folder = std::filesystem::canonical(found.dli_fname, fault).parent_path();
  for (int up = 0; !fault && up < 2; ++up) {
    folder = folder.parent_path();
    std::string path = (folder / "bin" / "windsplat").native();
    if (is_executable(path)) return path;
  }
  return {};
}

}  // namespace

namespace library {

Result<std::string> program() {
  const std::lock_guard lock(chosen().mutex);
  std::string& path = chosen().path;
  if (path.empty()) path = beside_the_library();
  if (path.empty()) {
    return make_error(ErrorKind::not_found,
                      "files are read by the program windsplat, which is not in the prefix of the "
                      "library: name it by set_program()");
  }
  if (!is_executable(path)) {
    return make_error(ErrorKind::not_found,
                      "the program that reads files cannot be executed: " + in_quotes(path));
  }
  return path;
}

}  // namespace library

void set_program(const std::string& path) {
  const std::lock_guard lock(chosen().mutex);
  chosen().path = path;
}

}  // namespace windsplat
