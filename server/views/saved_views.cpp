// An in-memory map with optional files. File names are ids generated or checked here, so that no
// client input becomes a path.
#include "server/views/saved_views.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/log.hpp"
#include "server/base/whole_file.hpp"

namespace windsplat::views {
namespace {

namespace fs = std::filesystem;
using protocol::SavedView;
using protocol::ViewDocument;

constexpr std::size_t file_bytes_max = protocol::limits::message_bytes_max;
constexpr std::string_view suffix = ".json";
constexpr int complaints_max = 20;  // limit on log lines for invalid files

// A file descriptor with RAII; closing it releases its lock.
class Handle {
 public:
  explicit Handle(int number = -1) : number_(number) {}
  ~Handle() {
    if (number_ >= 0) ::close(number_);
  }
  Handle(Handle&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  [[nodiscard]] int get() const { return number_; }

 private:
  int number_;
};

Error unusable(const fs::path& folder, const std::string& why) {
  std::string message = "the state folder ";
  message += in_quotes(folder.native());
  message += ' ';
  message += why;
  return make_error(ErrorKind::invalid, std::move(message));
}

std::string words_of(int fault) { return std::generic_category().message(fault); }

void warn_if_anybody_writes(int folder, const fs::path& path) {
  struct stat facts {};
  if (::fstat(folder, &facts) != 0) return;
  if ((facts.st_mode & S_IWOTH) == 0 || (facts.st_mode & S_ISVTX) != 0) return;
  std::array<char, 8> mode{};
  std::snprintf(mode.data(), mode.size(), "%04o", static_cast<unsigned>(facts.st_mode & 07777U));
  log::warn("saved views are writable by every user of this machine",
            {{"folder", path.native()}, {"mode", mode.data()}});
}

// Opens and locks the folder against other processes until the handle is closed.
Result<Handle> claim(const fs::path& folder) {
  std::error_code fault;
  fs::create_directories(folder, fault);
  if (fault) return unusable(folder, "cannot be created: " + fault.message());
  Handle handle(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (handle.get() < 0) return unusable(folder, "cannot be opened: " + words_of(errno));
  if (::flock(handle.get(), LOCK_EX | LOCK_NB) != 0) {
    return unusable(folder,
                    errno == EWOULDBLOCK
                        ? "is in use by another windsplat; use --state-dir to choose another"
                        : "cannot be locked: " + words_of(errno));
  }
  const Handle views(::openat(handle.get(), "views", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (views.get() < 0 && errno != ENOENT) {
    return unusable(folder, "has views that cannot be read: " + words_of(errno));
  }
  warn_if_anybody_writes(handle.get(), folder);
  if (views.get() >= 0) warn_if_anybody_writes(views.get(), folder / "views");
  return handle;
}

// The errno that prevents writing to the folder of views, or 0. Creates the folder if missing,
// readable only by its owner: knowledge of a view's id grants write access.
int write_fault(const fs::path& folder) {
  if (::mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST) return errno;
  return ::faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) == 0 ? 0 : errno;
}

// Reads a regular file of at most file_bytes_max bytes, or returns why not.
Result<std::string> read_small_file(const fs::path& path) {
  const auto refuse = [](const std::string& why) { return make_error(ErrorKind::bad_data, why); };
  const Handle file(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  if (file.get() < 0) return refuse(words_of(errno));
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) return refuse(words_of(errno));
  if (!S_ISREG(status.st_mode)) return refuse("not a regular file");
  if (static_cast<std::uint64_t>(status.st_size) > file_bytes_max) return refuse("file too long");
  std::string text(file_bytes_max + 1, '\0');
  std::size_t length = 0;
  while (length < text.size()) {
    const ssize_t got = ::read(file.get(), text.data() + length, text.size() - length);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return refuse(words_of(errno));
    if (got == 0) break;
    length += static_cast<std::size_t>(got);
  }
  text.resize(length);
  return text;
}

Result<SavedView> read_view(const fs::path& path) {
  const std::string name = path.filename().native();
  const std::string_view id = std::string_view(name).substr(0, protocol::view_id_chars);
  if (!protocol::is_view_id(id) || std::string_view(name).substr(id.size()) != suffix) {
    return make_error(ErrorKind::bad_data, "the file name is not a view id");
  }
  const auto text = read_small_file(path);
  if (!text) return text.error();
  auto saved = protocol::parse_view_file(*text);
  if (saved && saved->id != id) {
    return make_error(ErrorKind::bad_data, "the id does not match the file name");
  }
  return saved;
}

Result<std::string> random_id() {
  std::array<unsigned char, protocol::view_id_chars> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    return make_error(ErrorKind::internal, "no random numbers available");
  }
  std::string id;
  for (const unsigned char byte : bytes) id += protocol::view_id_letters[byte & 31U];
  return id;
}

Error full(const std::string& what) {
  return make_error(ErrorKind::out_of_memory, "this server stores at most " + what +
                                                  "; delete views that are no longer needed");
}

}  // namespace

struct SavedViews::State {
  struct Entry {
    SavedView saved;
    std::size_t bytes = 0;  // size of the view as JSON
  };

  [[nodiscard]] bool on_disk() const { return lock.get() >= 0; }
  [[nodiscard]] fs::path file_of(const std::string& id) const {
    std::string name = id;
    name += suffix;
    return folder / name;
  }

  // Removes temporary files `<id>.json.<process>.part` of a killed process: the folder is locked,
  // so no other process writes them.
  static bool is_left_over(const fs::path& path) {
    const std::string name = path.filename().native();
    const std::string_view id = std::string_view(name).substr(0, protocol::view_id_chars);
    std::error_code ignored;
    return protocol::is_view_id(id) && path.extension() == ".part" &&
           path.stem().extension() != suffix &&
           std::string_view(name).substr(id.size()).starts_with(".json.") &&
           fs::is_regular_file(fs::symlink_status(path, ignored));
  }

  // A read-only folder still serves its views.
  void read_folder() {
    if (const int fault = write_fault(folder); fault != 0) {
      log::warn("the state folder is not writable: saved views are read-only",
                {{"folder", folder.native()}, {"fault", words_of(fault)}});
    }
    std::error_code fault;
    int left_alone = 0;
    for (fs::directory_iterator at(folder, fault), end; !fault && at != end; at.increment(fault)) {
      if (is_left_over(at->path())) {
        std::error_code ignored;
        fs::remove(at->path(), ignored);
        continue;
      }
      auto read = entries.size() < options.views_max
                      ? read_view(at->path())
                      : make_error(ErrorKind::out_of_memory, "too many views");
      if (read) {
        const std::size_t size = protocol::encode_view_file(*read).size();
        if (bytes + size <= options.bytes_max) {
          bytes += size;
          std::string id = read->id;
          entries.emplace(std::move(id), Entry{std::move(*read), size});
          continue;
        }
        read = make_error(ErrorKind::out_of_memory, "too many bytes of views");
      }
      if (++left_alone > complaints_max) continue;
      log::warn("ignoring an unreadable saved view",
                {{"file", at->path().native()}, {"fault", read.error().message}});
    }
    if (fault) log::warn("cannot read all saved views", {{"fault", fault.message()}});
    log::info("saved views",
              {{"folder", folder.native()}, {"views", entries.size()}, {"left_alone", left_alone}});
  }

  [[nodiscard]] std::optional<Entry> find(const std::string& id) const {
    const std::lock_guard lock_map(reading);
    const auto at = entries.find(id);
    if (at == entries.end()) return std::nullopt;
    return at->second;
  }

  // The functions below require the mutex `changing`.
  [[nodiscard]] Result<std::string> unused_id() const {
    for (;;) {
      auto id = random_id();
      if (!id) return id;
      std::error_code ignored;
      const bool taken = entries.count(*id) > 0 ||
                         (on_disk() && fs::exists(fs::symlink_status(file_of(*id), ignored)));
      if (!taken) return id;
    }
  }

  [[nodiscard]] Error disk_error(const Error& error) const {
    log::error("cannot change a saved view on disk", {{"fault", error.message}});
    if (const int fault = write_fault(folder); fault != 0) {
      return make_error(ErrorKind::out_of_memory, "saved views are read-only: " + words_of(fault));
    }
    return make_error(error.kind, error.kind == ErrorKind::out_of_memory
                                      ? "the disk of the saved views is full"
                                      : "the view could not be changed on disk");
  }

  // `before`: size of the replaced entry, bytes.
  Result<SavedView> put(SavedView saved, std::size_t before) {
    const std::string text = protocol::encode_view_file(saved);
    WINDSPLAT_CHECK(text.size() <= file_bytes_max);  // guaranteed by the schema
    if (bytes - before + text.size() > options.bytes_max) {
      return full(std::to_string(options.bytes_max) + " bytes of views");
    }
    if (on_disk()) {
      static_cast<void>(write_fault(folder));  // creates the folder if that failed before
      const auto written = write_whole_file(file_of(saved.id), text, Sync::now);
      if (!written) return disk_error(written.error());
    }
    const std::lock_guard lock_map(reading);
    bytes = bytes - before + text.size();
    entries.insert_or_assign(saved.id, Entry{saved, text.size()});
    return saved;
  }

  Options options;
  fs::path folder;
  Handle lock;
  std::mutex changing;         // held during changes of disk and map
  mutable std::mutex reading;  // guards the map, which changes under both mutexes
  std::map<std::string, Entry> entries;
  std::size_t bytes = 0;
};

namespace {

Error unknown(const std::string& id) {
  return make_error(ErrorKind::not_found, "unknown view " + in_quotes(id));
}

}  // namespace

SavedViews::SavedViews(std::unique_ptr<State> state) : state_(std::move(state)) {}
SavedViews::~SavedViews() = default;

Result<std::shared_ptr<SavedViews>> SavedViews::open(Options options) {
  auto state = std::make_unique<State>();
  state->options = std::move(options);
  if (const fs::path& chosen = state->options.state_folder; !chosen.empty()) {
    auto lock = claim(chosen);
    if (!lock) return lock.error();
    state->lock = std::move(*lock);
    state->folder = fs::absolute(chosen) / "views";
    state->read_folder();
  }
  return std::shared_ptr<SavedViews>(new SavedViews(std::move(state)));
}

bool SavedViews::on_disk() const { return state_->on_disk(); }

Result<SavedView> SavedViews::find(const std::string& id) const {
  auto entry = state_->find(id);
  if (!entry) return unknown(id);
  return std::move(entry->saved);
}

Result<SavedView> SavedViews::add(ViewDocument view, std::string created) {
  const std::lock_guard lock(state_->changing);
  if (state_->entries.size() >= state_->options.views_max) {
    return full(std::to_string(state_->options.views_max) + " views");
  }
  auto id = state_->unused_id();
  if (!id) return id.error();
  return state_->put({std::move(*id), std::move(created), std::move(view)}, 0);
}

Result<std::optional<SavedView>> SavedViews::replace(const std::string& id, const Check& may,
                                                     const Change& change) {
  const std::lock_guard lock(state_->changing);
  auto entry = state_->find(id);
  if (!entry) return unknown(id);
  if (!may(entry->saved)) return std::optional<SavedView>();
  auto changed = change(entry->saved.view);
  if (!changed) return changed.error();
  entry->saved.view = std::move(*changed);
  auto put = state_->put(std::move(entry->saved), entry->bytes);
  if (!put) return put.error();
  return std::optional(std::move(*put));
}

Result<bool> SavedViews::remove(const std::string& id, const Check& may) {
  const std::lock_guard lock(state_->changing);
  const auto entry = state_->find(id);
  if (!entry) return unknown(id);
  if (!may(entry->saved)) return false;
  if (state_->on_disk()) {
    std::error_code fault;
    fs::remove(state_->file_of(id), fault);  // not an error if another process removed it
    if (fault) return state_->disk_error(make_error(ErrorKind::internal, fault.message()));
    if (const auto ok = sync_folder(state_->folder); !ok) return state_->disk_error(ok.error());
  }
  const std::lock_guard lock_map(state_->reading);
  state_->bytes -= entry->bytes;
  state_->entries.erase(id);
  return true;
}

}  // namespace windsplat::views
