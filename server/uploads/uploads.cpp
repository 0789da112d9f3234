// Each upload is written to a file of its own among those that are incomplete, and renamed once its
// digest is right; of a ZIP archive the folder that it was unpacked into.
#include "server/uploads/uploads.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <map>
#include <mutex>
#include <system_error>
#include <utility>

#include "server/base/disk_error.hpp"
#include "server/base/log.hpp"
#include "server/data/loader/unpack.hpp"

namespace windsplat::uploads {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t id_chars_max = 80;
constexpr std::size_t uploads_max = 256;
constexpr std::size_t uploads_per_address = uploads_max / 2;
constexpr std::uint64_t block_bytes = 4096;  // an upload takes at least one of the quota
constexpr std::size_t at_a_time_max = 16;
constexpr std::size_t at_a_time_per_address = 4;
constexpr const char* incomplete = ".incomplete";  // no id begins with a dot

bool is_id_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
         c == '_';
}

Error not_stored(int fault) { return disk_error(fault, "the upload cannot be stored"); }

std::uint64_t charge_of(std::uint64_t bytes) {
  return bytes == 0 ? 0 : std::max(bytes, block_bytes);
}

Error too_many(std::size_t kept, const std::string& whose) {
  return make_error(ErrorKind::out_of_memory, std::to_string(kept) +
                                                  " uploads are kept, as many as " + whose +
                                                  "; delete some or wait until they expire");
}

bool is_archive(const std::string& id) { return id.ends_with(".zip"); }

// Into which the archive at a path is unpacked.
fs::path folder_beside(const fs::path& path) { return path.native() + ".folder"; }

// The folder, or the only one that it has, if it has nothing else.
fs::path innermost(const fs::path& folder) {
  std::error_code fault;
  const fs::directory_iterator only(folder, fault);
  if (fault || only == fs::directory_iterator() || !only->is_directory(fault)) return folder;
  const fs::path path = only->path();
  return std::next(fs::directory_iterator(folder, fault)) == fs::directory_iterator() ? path
                                                                                      : folder;
}

std::string group_of(const std::string& id) { return id.substr(0, id.find('.')); }

bool is_real_folder(const fs::path& path) {
  std::error_code fault;
  return fs::is_directory(fs::symlink_status(path, fault));
}

std::vector<fs::path> entries_of(const fs::path& folder, std::error_code& fault) {
  std::vector<fs::path> out;
  for (fs::directory_iterator at(folder, fault); !fault && at != fs::directory_iterator();
       at.increment(fault)) {
    out.push_back(at->path());
  }
  return out;
}

}  // namespace

bool is_upload_id(std::string_view text) {
  if (text.empty() || text.size() > id_chars_max) return false;
  if (text.front() == '.' || text.back() == '.' || text.front() == '-') return false;
  return text.find("..") == std::string_view::npos &&
         std::all_of(text.begin(), text.end(), [](char c) { return c == '.' || is_id_letter(c); });
}

struct Uploads::State {
  struct Entry {
    Upload upload;
    std::string address;
    std::uint64_t taken = 0;  // bytes on disk
    std::vector<std::string> datasets;
  };
  // An upload that is no longer visible.
  struct Dropped {
    Entry entry;
    fs::path path;
  };
  // Of an address: what its uploads take, complete or not.
  struct Share {
    std::uint64_t bytes = 0;
    std::size_t at_a_time = 0;
    std::size_t kept = 0;  // complete, each with bytes
    std::shared_ptr<const void> key = std::make_shared<char>();
  };

  // Unpacks the archive at a path beside it. Errors: those of loader::unpack(); out_of_memory
  // (quota).
  Result<void> unpack(const Announced& announced, const fs::path& path, const CancelToken& cancel) {
    const fs::path folder = folder_beside(path);
    if (::mkdir(folder.c_str(), S_IRWXU) != 0) return not_stored(errno);
    const auto reserve = [&](std::uint64_t bytes) -> Result<void> {
      // The archive exists until it is unpacked.
      const std::uint64_t both = bytes + charge_of(announced.bytes);
      if (both > options.bytes_max / 2) {
        return make_error(ErrorKind::too_large,
                          "the archive and its files take " + std::to_string(both) +
                              " bytes, above the limit of " +
                              std::to_string(options.bytes_max / 2) + ", half of --upload-limit");
      }
      return take_for(announced, bytes, "unpacked takes " + std::to_string(bytes));
    };
    return data::loader::unpack(
        {.archive = path, .folder = folder, .reserve = reserve, .cancel = cancel});
  }

  // For an upload that is being received, which `size` ("takes 5") bytes. Errors: out_of_memory.
  Result<void> take_for(const Announced& announced, std::uint64_t bytes, const std::string& size) {
    const std::lock_guard lock(mutex);
    if (bytes > left_for(announced.address)) return no_room(announced.address, size);
    bytes_taken += bytes;
    shares[announced.address].bytes += bytes;
    receiving[announced.id] += bytes;
    return {};
  }

  // Removes the files, perhaps thousands, for which nobody else waits.
  void remove_files(const Dropped& dropped) {
    const auto& [entry, path] = dropped;
    std::error_code fault;
    fs::remove_all(path, fault);
    if (fault) {
      log::warn("an upload cannot be removed",
                {{"upload", entry.upload.id}, {"fault", fault.message()}});
    }
    const std::lock_guard lock(mutex);
    release(entry.address, entry.taken);
  }

  // The same of an archive that was unpacked, gigabytes perhaps.
  void remove_archive(const fs::path& path, const std::string& address, std::uint64_t charged) {
    std::error_code fault;
    fs::remove(path, fault);
    fs::remove_all(folder_beside(path), fault);
    const std::lock_guard lock(mutex);
    release(address, charged);
  }

  // The others require the mutex.
  [[nodiscard]] std::uint64_t left_for(const std::string& address) const {
    const auto share = shares.find(address);
    const std::uint64_t own = share == shares.end() ? 0 : share->second.bytes;
    return std::min(options.bytes_max - bytes_taken, options.bytes_max / 2 - own);
  }
  [[nodiscard]] Error no_room(const std::string& address, const std::string& size) const {
    return make_error(ErrorKind::out_of_memory,
                      "the upload " + size + " bytes, and " + std::to_string(left_for(address)) +
                          " are left of --upload-limit " + std::to_string(options.bytes_max) +
                          ", of which an address may have half; delete "
                          "uploads, or wait until they expire");
  }
  void release(const std::string& address, std::uint64_t bytes) {
    bytes_taken -= bytes;
    const auto share = shares.find(address);
    share->second.bytes -= bytes;
    if (share->second.bytes == 0 && share->second.at_a_time == 0) shares.erase(share);
  }
  void end_receiving(const std::string& id, const std::string& address) {
    receiving.erase(id);
    --shares[address].at_a_time;
  }
  // Errors: busy; out_of_memory (too many).
  [[nodiscard]] Result<void> check_count(const std::string& address) const {
    const auto share = shares.find(address);
    const Share taken = share == shares.end() ? Share{} : share->second;
    if (receiving.size() >= at_a_time_max || taken.at_a_time >= at_a_time_per_address) {
      return Error{ErrorKind::busy, "too many uploads at a time", {}, 1};
    }
    if (taken.kept + taken.at_a_time >= uploads_per_address) {
      return too_many(uploads_per_address, "an address may have");
    }
    if (entries.size() + receiving.size() >= uploads_max) {
      return too_many(uploads_max, "all addresses may have");
    }
    return {};
  }
  // The id is free again; its room only after remove_files().
  Dropped drop(std::map<std::string, Entry>::iterator at) {
    Dropped out{std::move(at->second), options.folder / incomplete / std::to_string(count++)};
    --shares[out.entry.address].kept;
    entries.erase(at);
    const fs::path path = options.folder / path_of(out.entry.upload.id);
    std::error_code fault;
    fs::rename(path, out.path, fault);
    if (fault) fs::remove_all(path, fault);
    fs::remove(path.parent_path(), fault);  // unless it has other files
    return out;
  }

  Options options;
  std::mutex mutex;
  std::uint64_t bytes_taken = 0;
  std::uint64_t count = 0;  // names of incomplete files
  std::map<std::string, Entry> entries;
  std::map<std::string, std::uint64_t> receiving;  // ids, and the bytes that each has taken
  std::map<std::string, Share> shares;
};

Uploads::Uploads(std::shared_ptr<State> state) : state_(std::move(state)) {}

Uploads::~Uploads() {
  if (const auto ok = remove_leftovers(state_->options.folder); !ok) {
    log::warn("uploads cannot be removed", {{"fault", ok.error().message}});
  }
}

// Uploads are below the folder of their group; what does not have such a name is not ours.
Result<void> Uploads::remove_leftovers(const fs::path& folder) {
  if (!is_real_folder(folder) || !is_real_folder(folder / incomplete)) return {};
  std::error_code fault;
  for (const fs::path& group : entries_of(folder, fault)) {
    const std::string name = group.filename();
    if (name == incomplete || !is_upload_id(name) || !is_real_folder(group)) continue;
    for (const fs::path& one : entries_of(group, fault)) {
      const std::string id = one.filename();
      if (is_upload_id(id) && group_of(id) == name) fs::remove_all(one, fault);
      if (fault) break;
    }
    ::rmdir(group.c_str());  // unless it has other files
    if (fault) break;
  }
  // The mark by which the folder is known goes last.
  if (!fault) fs::remove_all(folder / incomplete, fault);
  if (fault) {
    return make_error(ErrorKind::internal,
                      "'" + printable(folder.native()) + "' cannot be emptied: " + fault.message());
  }
  ::rmdir(folder.c_str());  // unless it has other files
  return {};
}

Result<std::shared_ptr<Uploads>> Uploads::open(Options options) {
  const auto unusable = [&](const std::string& why) {
    return make_error(ErrorKind::invalid,
                      "the folder of uploads '" + printable(options.folder.native()) + "' " + why);
  };
  if (const auto ok = remove_leftovers(options.folder); !ok) return unusable(ok.error().message);
  for (const fs::path& folder : {options.folder, options.folder / incomplete}) {
    ::rmdir(folder.c_str());  // an empty one may have another mode
    if (::mkdir(folder.c_str(), S_IRWXU) == 0) continue;
    return unusable(errno == EEXIST
                        ? "has other files: choose another --state-dir"
                        : "cannot be created: " + std::generic_category().message(errno));
  }
  auto state = std::make_shared<State>();
  state->options = std::move(options);
  return std::shared_ptr<Uploads>(new Uploads(std::move(state)));
}

std::uint64_t Uploads::bytes_max() const { return state_->options.bytes_max; }

std::uint64_t Uploads::bytes_max_per_address() const { return bytes_max() / 2; }

const fs::path& Uploads::folder() const { return state_->options.folder; }

std::string Uploads::path_of(const std::string& id) { return group_of(id) + '/' + id; }

Result<std::shared_ptr<Incoming>> Uploads::begin(const Announced& announced) {
  const auto& [id, bytes, keep_s, digest, address] = announced;
  if (!is_upload_id(id)) {
    return make_error(ErrorKind::invalid, "the id of an upload is the name of a file, 1 to " +
                                              std::to_string(id_chars_max) +
                                              " letters, digits, '-', '_' and single dots, not '" +
                                              printable(id, id_chars_max) + "'");
  }
  if (bytes == 0) return make_error(ErrorKind::invalid, "an upload must have a body");
  if (bytes > bytes_max_per_address()) {
    return make_error(ErrorKind::too_large,
                      "the upload has " + std::to_string(bytes) + " bytes, above the limit of " +
                          std::to_string(bytes_max_per_address()) + ", half of --upload-limit");
  }
  State& state = *state_;
  const std::lock_guard lock(state.mutex);
  if (state.entries.contains(id)) {
    return make_error(ErrorKind::conflict, "an upload '" + id + "' exists: delete it first");
  }
  if (state.receiving.contains(id)) {
    return make_error(ErrorKind::conflict, "an upload '" + id + "' is being received");
  }
  if (const auto ok = state.check_count(address); !ok) return ok.error();
  if (charge_of(bytes) > state.left_for(address)) {
    return state.no_room(address, "takes " + std::to_string(charge_of(bytes)));
  }
  state.receiving[id] = 0;
  State::Share& share = state.shares[address];
  ++share.at_a_time;
  const fs::path path = state.options.folder / incomplete / std::to_string(state.count++);
  return std::shared_ptr<Incoming>(new Incoming(state_, announced, path, share.key));
}

Result<Upload> Uploads::find(const std::string& id) const {
  const std::lock_guard lock(state_->mutex);
  const auto at = state_->entries.find(id);
  if (at != state_->entries.end()) return at->second.upload;
  return make_error(ErrorKind::not_found,
                    "there is no upload '" + printable(id, id_chars_max) + "'");
}

bool Uploads::opened(const std::string& id, const std::string& dataset) {
  const std::lock_guard lock(state_->mutex);
  const auto at = state_->entries.find(id);
  if (at == state_->entries.end()) return false;
  auto& datasets = at->second.datasets;
  if (std::find(datasets.begin(), datasets.end(), dataset) == datasets.end()) {
    datasets.push_back(dataset);
  }
  return true;
}

Result<std::vector<std::string>> Uploads::remove(const std::string& id) {
  std::optional<State::Dropped> dropped;
  {
    const std::lock_guard lock(state_->mutex);
    const auto at = state_->entries.find(id);
    if (at != state_->entries.end()) dropped = state_->drop(at);
  }
  if (!dropped) {
    return make_error(ErrorKind::not_found,
                      "there is no upload '" + printable(id, id_chars_max) + "'");
  }
  state_->remove_files(*dropped);
  return std::move(dropped->entry.datasets);
}

std::vector<std::string> Uploads::expire(std::time_t now) {
  std::vector<State::Dropped> all;
  {
    const std::lock_guard lock(state_->mutex);
    for (auto at = state_->entries.begin(); at != state_->entries.end();) {
      const auto one = at++;
      if (one->second.upload.expires > now) continue;
      log::info("an upload has expired", {{"upload", one->first}});
      all.push_back(state_->drop(one));
    }
  }
  std::vector<std::string> out;
  for (const State::Dropped& dropped : all) {
    state_->remove_files(dropped);
    const auto& datasets = dropped.entry.datasets;
    out.insert(out.end(), datasets.begin(), datasets.end());
  }
  return out;
}

Incoming::Incoming(std::shared_ptr<Uploads::State> state, Announced announced, fs::path path,
                   std::shared_ptr<const void> address_key)
    : state_(std::move(state)),
      announced_(std::move(announced)),
      path_(std::move(path)),
      address_key_(std::move(address_key)) {}

bool Incoming::is_archive() const { return uploads::is_archive(announced_.id); }

Incoming::~Incoming() { discard(); }

void Incoming::discard() {
  if (std::exchange(ended_, true)) return;
  if (file_ >= 0) {
    ::close(file_);
    ::unlink(path_.c_str());
    std::error_code fault;
    if (is_archive()) fs::remove_all(folder_beside(path_), fault);
  }
  const std::lock_guard lock(state_->mutex);
  const std::uint64_t taken = state_->receiving[announced_.id];
  state_->end_receiving(announced_.id, announced_.address);
  state_->release(announced_.address, taken);
}

Result<void> Incoming::open_file() {
  if (file_ >= 0) return {};
  file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW,
                 S_IRUSR | S_IWUSR);
  if (file_ < 0) return not_stored(errno);
  return {};
}

Result<void> Incoming::write(std::span<const std::byte> bytes) {
  auto stored = store(bytes);
  if (!stored) discard();
  return stored;
}

Result<void> Incoming::store(std::span<const std::byte> bytes) {
  if (bytes.size() > announced_.bytes - written_) {
    return make_error(ErrorKind::invalid, "the upload is longer than announced");
  }
  if (auto ok = open_file(); !ok) return ok;
  const std::uint64_t more = charge_of(written_ + bytes.size()) - charge_of(written_);
  const std::string size = "takes " + std::to_string(charge_of(announced_.bytes));
  if (auto ok = state_->take_for(announced_, more, size); !ok) return ok;
  for (auto rest = bytes; !rest.empty();) {
    const ssize_t done = ::write(file_, rest.data(), rest.size());
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) return not_stored(errno);
    rest = rest.subspan(static_cast<std::size_t>(done));
  }
  hasher_.add(bytes);
  written_ += bytes.size();
  return {};
}

Result<Upload> Incoming::finish(const CancelToken& cancel) {
  auto upload = publish(cancel);
  if (!upload) discard();
  return upload;
}

Result<Upload> Incoming::publish(const CancelToken& cancel) {
  if (written_ != announced_.bytes) {
    return make_error(ErrorKind::invalid, "the upload is shorter than announced");
  }
  const Sha256 digest = hasher_.finish();
  if (announced_.digest && digest != *announced_.digest) {
    return make_error(ErrorKind::invalid, "the upload has the digest " + digest_text(digest) +
                                              ", not the announced " +
                                              digest_text(*announced_.digest));
  }
  const bool archive = is_archive();
  if (archive) {
    if (const auto ok = state_->unpack(announced_, path_, cancel); !ok) return ok.error();
  }
  Upload upload{announced_.id, announced_.bytes, digest, 0};
  std::uint64_t spare = 0;  // bytes that are released when the archive is removed
  {
    const fs::path from = archive ? innermost(folder_beside(path_)) : path_;
    const std::lock_guard lock(state_->mutex);
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "the upload was cancelled");
    const fs::path path = state_->options.folder / Uploads::path_of(announced_.id);
    if (::mkdir(path.parent_path().c_str(), S_IRWXU) != 0 && errno != EEXIST) {
      return not_stored(errno);
    }
    if (::rename(from.c_str(), path.c_str()) != 0) return not_stored(errno);
    ended_ = true;
    upload.expires = std::time(nullptr) + announced_.keep_s;
    const std::uint64_t taken = state_->receiving[announced_.id];
    // The folder of an archive takes a block, even if it is empty.
    if (archive) spare = std::min(charge_of(announced_.bytes), taken - block_bytes);
    state_->end_receiving(announced_.id, announced_.address);
    ++state_->shares[announced_.address].kept;
    state_->entries[announced_.id] = {upload, announced_.address, taken - spare, {}};
  }
  ::close(file_);
  if (archive) state_->remove_archive(path_, announced_.address, spare);
  return upload;
}

}  // namespace windsplat::uploads
