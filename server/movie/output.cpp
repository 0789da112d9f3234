#include "server/movie/output.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>
#include <vector>

#include "server/base/disk_error.hpp"
#include "server/base/whole_file.hpp"

namespace windsplat::movie {
namespace {

namespace fs = std::filesystem;

constexpr mode_t mode_of_new_files = 0666;  // before umask
constexpr std::size_t copied_at_once = std::size_t{1} << 18U;

// Returns 0 or the errno of the failed call.
int write_all(int file, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t wrote = ::write(file, bytes.data(), bytes.size());
    if (wrote >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(wrote));
    } else if (errno != EINTR) {
      return errno;
    }
  }
  return 0;
}

}  // namespace

data::Descriptor unnamed_file() {
  std::error_code fault;
  const fs::path folder = fs::temp_directory_path(fault);
  if (fault) {
    errno = fault.value();
    return {};
  }
  std::string name = (folder / "windsplat-XXXXXX").native();
  data::Descriptor file(::mkostemp(name.data(), O_CLOEXEC));
  if (file) ::unlink(name.c_str());
  return file;
}

Error Output::failed(const char* what, int fault) const {
  const std::string name = path_.empty() ? std::string("the output") : in_quotes(path_.native());
  return disk_error(fault, std::string(what) + ' ' + name);
}

Result<Output> Output::at(const fs::path& path) {
  Output out;
  out.path_ = path;
  if (is_stream(path)) {
    const int inherited = inherited_descriptor(path);
    if (inherited >= 0) return to(inherited);
    out.file_.reset(::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY));
    if (!out.file_) return out.failed("cannot write", errno);
    return out;
  }
  out.target_ = end_of_links(path);
  std::error_code fault;
  if (fs::is_directory(out.target_, fault)) return out.failed("cannot write", EISDIR);
  const fs::path part = part_of(out.target_);
  // A file left by an earlier process with the same id is replaced.
  if (fs::is_regular_file(fs::symlink_status(part, fault))) fs::remove(part, fault);
  constexpr int flags = O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW;
  out.file_.reset(::open(part.c_str(), flags, mode_of_new_files));
  if (!out.file_) return out.failed("cannot create", errno);
  out.part_ = part;
  return out;
}

Result<Output> Output::to(int descriptor) {
  Output out;
  out.file_.reset(::fcntl(descriptor, F_DUPFD_CLOEXEC, 0));
  if (!out.file_) return out.failed("cannot write", errno);
  return out;
}

Result<Output> Output::in_place(int file) {
  auto out = to(file);
  if (out) out->in_place_ = true;
  return out;
}

Output::Output(Output&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      part_(std::exchange(other.part_, fs::path())),
      file_(std::move(other.file_)),
      unnamed_(std::move(other.unnamed_)),
      in_place_(other.in_place_) {}

Output::~Output() {
  if (!part_.empty()) ::unlink(part_.c_str());
}

Result<int> Output::file_for_program() {
  if (!part_.empty() || in_place_) return file_.number();
  unnamed_ = unnamed_file();
  if (!unnamed_) return failed("there is no room for temporary files to write", errno);
  return unnamed_.number();
}

Result<void> Output::write(std::span<const std::uint8_t> bytes) {
  if (const int fault = write_all(file_.number(), bytes)) return failed("cannot write", fault);
  return {};
}

Result<void> Output::copy_to_stream() {
  std::vector<std::uint8_t> bytes(copied_at_once);
  for (off_t at = 0;;) {
    const ssize_t got = ::pread(unnamed_.number(), bytes.data(), bytes.size(), at);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failed("cannot read the temporary file of", errno);
    if (got == 0) return {};
    const auto count = static_cast<std::size_t>(got);
    if (auto done = write(std::span(bytes).first(count)); !done) return done;
    at += got;
  }
}

Result<void> Output::complete() {
  if (part_.empty()) return unnamed_ ? copy_to_stream() : Result<void>();
  std::error_code ignored;
  const fs::file_status replaced = fs::status(target_, ignored);
  if (fs::is_regular_file(replaced)) fs::permissions(part_, replaced.permissions(), ignored);
  const int file = file_.give();
  if (::close(file) != 0) return failed("cannot write", errno);
  if (::rename(part_.c_str(), target_.c_str()) != 0) return failed("cannot write", errno);
  part_.clear();
  return {};
}

}  // namespace windsplat::movie
