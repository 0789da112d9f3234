// Of each URL two files: URL-DIGEST.meta (validators, bytes and the digest of the data) and
// URL-DIGEST.DATA-DIGEST. Those being received are part-RANDOM.
#include "server/data/fetch/object_cache.hpp"

#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

#include "server/base/whole_file.hpp"

namespace windsplat::data::fetch {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t meta_bytes_max = 4096;
constexpr std::size_t confirmed_max = std::size_t{1} << 16;
constexpr std::uint64_t meta_space = 4096;  // of a file in file systems
constexpr std::string_view part_prefix = "part-";
constexpr std::string_view meta_suffix = ".meta";
constexpr std::chrono::hours part_age_max{24};

std::string hex(const unsigned char* bytes, std::size_t count) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string out;
  for (std::size_t i = 0; i < count; ++i) {
    out += digits[bytes[i] >> 4U];
    out += digits[bytes[i] & 15U];
  }
  return out;
}

std::shared_ptr<EVP_MD_CTX> new_digest() {
  std::shared_ptr<EVP_MD_CTX> out(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  if (!out || EVP_DigestInit_ex(out.get(), EVP_sha256(), nullptr) != 1) throw std::bad_alloc();
  return out;
}

using Sha256 = std::array<unsigned char, 32>;

Sha256 finish(EVP_MD_CTX* digest) {
  Sha256 out{};
  if (EVP_DigestFinal_ex(digest, out.data(), nullptr) != 1) throw std::bad_alloc();
  return out;
}

bool is_hex(std::string_view text, std::size_t count) {
  return text.size() == count && text.find_first_not_of("0123456789abcdef") == text.npos;
}

// Only files with names that this cache gives are counted or removed.
bool is_data(std::string_view name) {
  return name.size() == 129 && name[64] == '.' && is_hex(name.substr(0, 64), 64) &&
         is_hex(name.substr(65), 64);
}

bool is_part(std::string_view name) {
  return name.starts_with(part_prefix) && is_hex(name.substr(part_prefix.size()), 32);
}

// A time of modification derived from the digest of a file's bytes; also marks the file as used.
std::array<timespec, 2> times_of(const Sha256& digest) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < 8; ++i) number = number << 8U | digest.at(i);
  constexpr std::uint64_t seconds = std::uint64_t{1} << 31;
  constexpr std::uint64_t nanoseconds = 1'000'000'000;
  timespec modified{};
  modified.tv_sec = static_cast<time_t>(number % seconds);
  modified.tv_nsec = static_cast<long>(number / seconds % nanoseconds);
  timespec used{};
  used.tv_nsec = UTIME_NOW;
  return {used, modified};
}

void mark_used(int file) {
  std::array<timespec, 2> times{};
  times[0].tv_nsec = UTIME_NOW;
  times[1].tv_nsec = UTIME_OMIT;
  ::futimens(file, times.data());
}

struct Meta {
  Validators validators;
  std::string data;  // digest
  std::uint64_t bytes = 0;
};

std::string text_of(const Meta& meta) {
  return meta.data + '\n' + std::to_string(meta.bytes) + '\n' + meta.validators.etag + '\n' +
         meta.validators.last_modified + '\n';
}

std::optional<Meta> read_meta(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  std::string text(meta_bytes_max + 1, '\0');
  const ssize_t got = file ? ::read(file.number(), text.data(), text.size()) : -1;
  if (got <= 0 || static_cast<std::size_t>(got) > meta_bytes_max) return {};
  text.resize(static_cast<std::size_t>(got));
  std::array<std::string, 4> lines;
  for (std::string& line : lines) {
    const std::size_t end = text.find('\n');
    if (end == std::string::npos) return {};
    line = text.substr(0, end);
    text.erase(0, end + 1);
  }
  Meta out{{lines[2], lines[3]}, lines[0], 0};
  const char* const end = lines[1].data() + lines[1].size();
  const auto [at, fault] = std::from_chars(lines[1].data(), end, out.bytes);
  const bool sound = text.empty() && fault == std::errc() && at == end &&
                     out.data.find_first_not_of("0123456789abcdef") == std::string::npos;
  return sound ? std::optional(std::move(out)) : std::nullopt;
}

// Blocks on disk; the small file beside it takes one.
std::uint64_t space_of(const struct stat& status) {
  return std::max<std::uint64_t>(static_cast<std::uint64_t>(status.st_blocks) * 512, meta_space) +
         meta_space;
}

Error disk_fault(int reason) {
  return make_error(ErrorKind::out_of_memory, "the folder of --data-cache cannot be written: " +
                                                  std::generic_category().message(reason));
}

}  // namespace

OpenSpace::OpenSpace(OpenSpace&& other) noexcept
    : cache_(other.cache_), bytes_(std::exchange(other.bytes_, 0)) {}

OpenSpace::~OpenSpace() {
  if (bytes_ == 0) return;
  const std::lock_guard lock(cache_->mutex_);
  cache_->open_bytes_ -= bytes_;
}

void OpenSpace::add(std::uint64_t bytes) {
  const std::lock_guard lock(cache_->mutex_);
  bytes_ += bytes;
  cache_->open_bytes_ += bytes;
  cache_->evict(cache_->options_.bytes_max);
}

bool OpenSpace::reserve(std::uint64_t bytes) {
  const std::lock_guard lock(cache_->mutex_);
  const std::uint64_t bytes_max = cache_->options_.bytes_max;
  if (bytes > bytes_max || cache_->open_bytes_ > bytes_max - bytes) return false;
  bytes_ += bytes;
  cache_->open_bytes_ += bytes;
  cache_->evict(bytes_max);
  return true;
}

void OpenSpace::give_back(std::uint64_t bytes) {
  const std::lock_guard lock(cache_->mutex_);
  bytes_ -= bytes;
  cache_->open_bytes_ -= bytes;
}

PartialFile::PartialFile(Descriptor file, std::string path, ObjectCache& cache)
    : file_(std::move(file)), space_(cache), path_(std::move(path)), digest_(new_digest()) {}

PartialFile::PartialFile(PartialFile&& other) noexcept
    : file_(std::move(other.file_)),
      space_(std::move(other.space_)),
      path_(std::exchange(other.path_, {})),
      bytes_(other.bytes_),
      digest_(std::move(other.digest_)) {}

PartialFile::~PartialFile() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

bool PartialFile::append(std::string_view bytes) {
  constexpr std::uint64_t counted_at_once = std::uint64_t{64} << 10;
  EVP_DigestUpdate(digest_.get(), bytes.data(), bytes.size());
  const std::uint64_t counted = bytes_ / counted_at_once;
  bytes_ += bytes.size();
  if (const std::uint64_t more = bytes_ / counted_at_once - counted; more > 0) {
    space_.add(more * counted_at_once);
  }
  while (!bytes.empty()) {
    const ssize_t wrote = ::write(file_.number(), bytes.data(), bytes.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(wrote));
  }
  return true;
}

std::pair<Descriptor, OpenSpace> PartialFile::take() {
  ::unlink(path_.c_str());
  path_.clear();
  return {std::move(file_), std::move(space_)};
}

ObjectCache::ObjectCache(CacheOptions options) : options_(std::move(options)) {}

std::string ObjectCache::digest_of(const std::string& text) {
  const auto digest = new_digest();
  EVP_DigestUpdate(digest.get(), text.data(), text.size());
  const Sha256 out = finish(digest.get());
  return hex(out.data(), out.size());
}

Result<std::unique_ptr<ObjectCache>> ObjectCache::open(CacheOptions options) {
  std::error_code fault;
  const fs::path folder(options.folder);
  const auto refused = [&](const std::string& why) {
    return make_error(ErrorKind::invalid, "--data-cache " + in_quotes(options.folder) + ": " + why);
  };
  if (folder.has_parent_path()) fs::create_directories(folder.parent_path(), fault);
  if (::mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST) {
    return refused(std::generic_category().message(errno));
  }
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) ||
      ::access(folder.c_str(), R_OK | W_OK | X_OK) != 0) {
    return refused("it is not a folder that can be written");
  }
  // Whoever can write to it decides what is shown.
  if (status.st_uid != ::geteuid() || (status.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    return refused("it belongs to another user, or others may write to it");
  }
  std::unique_ptr<ObjectCache> out(new ObjectCache(std::move(options)));
  const std::lock_guard lock(out->mutex_);
  out->scan();
  out->evict(out->options_.bytes_max);
  return out;
}

std::string ObjectCache::path_of(const std::string& name) const {
  return options_.folder + '/' + name;
}

// Counts the files, and removes those that a process left behind.
void ObjectCache::scan() {
  bytes_ = 0;
  std::error_code fault;
  const auto now = std::chrono::system_clock::now();
  for (fs::directory_iterator at(options_.folder, fault), end; !fault && at != end;
       at.increment(fault)) {
    const std::string name = at->path().filename().native();
    struct stat status {};
    if (::stat(at->path().c_str(), &status) != 0) continue;
    if (is_part(name)) {
      const auto written = std::chrono::system_clock::from_time_t(status.st_mtim.tv_sec);
      if (now - written > part_age_max) ::unlink(at->path().c_str());
    } else if (is_data(name)) {
      bytes_ += space_of(status);
    }
  }
}

void ObjectCache::evict(std::uint64_t bytes_max) {
  if (bytes_ + open_bytes_ <= bytes_max) return;
  struct Candidate {
    timespec used;
    std::uint64_t space;
    std::string name;
  };
  std::vector<Candidate> candidates;
  bytes_ = 0;  // other processes may have added or removed files
  std::error_code fault;
  for (fs::directory_iterator at(options_.folder, fault), end; !fault && at != end;
       at.increment(fault)) {
    std::string name = at->path().filename().native();
    struct stat status {};
    if (!is_data(name) || ::stat(at->path().c_str(), &status) != 0) {
      continue;
    }
    bytes_ += space_of(status);
    candidates.push_back({status.st_atim, space_of(status), std::move(name)});
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::pair(a.used.tv_sec, a.used.tv_nsec) < std::pair(b.used.tv_sec, b.used.tv_nsec);
  });
  // Some space beyond what is needed, so that the next files do not read the folder again.
  const std::uint64_t goal = bytes_max - bytes_max / 16;
  for (const Candidate& one : candidates) {
    if (bytes_ + open_bytes_ <= goal) break;
    const std::string url = one.name.substr(0, one.name.find('.'));
    ::unlink(path_of(one.name).c_str());
    ::unlink(path_of(url + std::string(meta_suffix)).c_str());
    confirmed_.erase(url);
    bytes_ -= one.space;
  }
}

std::optional<ObjectCache::Entry> ObjectCache::find(const std::string& url) {
  const std::string name = digest_of(url);
  auto meta = read_meta(path_of(name + std::string(meta_suffix)));
  if (!meta) return {};
  Entry out;
  out.file.reset(
      ::open(path_of(name + '.' + meta->data).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  struct stat status {};
  if (!out.file || ::fstat(out.file.number(), &status) != 0 || !S_ISREG(status.st_mode) ||
      static_cast<std::uint64_t>(status.st_size) != meta->bytes) {
    return {};
  }
  mark_used(out.file.number());
  out.validators = std::move(meta->validators);
  out.bytes = meta->bytes;
  const std::lock_guard lock(mutex_);
  const auto confirmed = confirmed_.find(name);
  out.is_fresh = confirmed != confirmed_.end() &&
                 std::chrono::steady_clock::now() - confirmed->second < options_.fresh_time;
  return out;
}

Result<PartialFile> ObjectCache::begin() {
  // Process ids are not unique among containers that share the folder.
  std::array<unsigned char, 16> number{};
  if (::getentropy(number.data(), number.size()) != 0) return disk_fault(errno);
  const std::string path = path_of(std::string(part_prefix) + hex(number.data(), number.size()));
  Descriptor file(
      ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR));
  if (!file) return disk_fault(errno);
  return PartialFile(std::move(file), path, *this);
}

Result<Descriptor> ObjectCache::keep(const std::string& url, PartialFile part,
                                     const Validators& validators) {
  const Sha256 digest = finish(part.digest_.get());
  const std::string name = digest_of(url);
  const std::string meta_path = path_of(name + std::string(meta_suffix));
  const Meta meta{validators, hex(digest.data(), digest.size()), part.bytes_};
  const std::string path = path_of(name + '.' + meta.data);
  const std::lock_guard lock(mutex_);  // two threads may keep the same URL
  const auto before = read_meta(meta_path);
  // The descriptor of the loader must not permit writing.
  Descriptor file(::open(part.path_.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  struct stat status {};
  if (!file || ::futimens(part.file_.number(), times_of(digest).data()) != 0 ||
      ::fstat(part.file_.number(), &status) != 0 ||
      ::rename(part.path_.c_str(), path.c_str()) != 0) {
    return disk_fault(errno);
  }
  part.path_.clear();
  if (auto written = write_whole_file(meta_path, text_of(meta)); !written) {
    ::unlink(path.c_str());
    return make_error(ErrorKind::out_of_memory, written.error().message);
  }
  if (before && before->data != meta.data) ::unlink(path_of(name + '.' + before->data).c_str());
  bytes_ += space_of(status);
  open_bytes_ -= std::exchange(part.space_.bytes_, 0);
  if (confirmed_.size() >= confirmed_max) confirmed_.clear();
  confirmed_[name] = std::chrono::steady_clock::now();
  evict(options_.bytes_max);
  return file;
}

void ObjectCache::confirm(const std::string& url) {
  const std::lock_guard lock(mutex_);
  if (confirmed_.size() >= confirmed_max) confirmed_.clear();
  confirmed_[digest_of(url)] = std::chrono::steady_clock::now();
}

void ObjectCache::remove(const std::string& url) {
  const std::string name = digest_of(url);
  const auto meta = read_meta(path_of(name + std::string(meta_suffix)));
  const std::lock_guard lock(mutex_);
  confirmed_.erase(name);
  if (!meta) return;
  ::unlink(path_of(name + '.' + meta->data).c_str());
  ::unlink(path_of(name + std::string(meta_suffix)).c_str());
}

std::uint64_t ObjectCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_ + open_bytes_;
}

}  // namespace windsplat::data::fetch
