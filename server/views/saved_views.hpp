// Storage of saved views under short ids: in memory and, with a folder, each in its own file.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "protocol/limits.hpp"
#include "protocol/saved_view.hpp"
#include "server/base/error.hpp"

namespace windsplat::views {

struct Options {
  // Views are stored in its subfolder "views"; both are created if missing. Empty: memory only.
  std::filesystem::path state_folder;
  std::size_t views_max = std::size_t{protocol::limits::views_max};
  std::size_t bytes_max = std::size_t{protocol::limits::views_bytes_max};  // limit on all views, as
                                                                           // JSON
};

// Thread-safe. find() never waits for a disk; changes do, one at a time.
class SavedViews {
 public:
  // Reads the stored views. Other files are logged and ignored; a read-only folder serves its views
  // and refuses changes. Errors: invalid if the folder cannot be used or another process uses it.
  static Result<std::shared_ptr<SavedViews>> open(Options options);
  ~SavedViews();
  SavedViews(const SavedViews&) = delete;
  SavedViews& operator=(const SavedViews&) = delete;

  [[nodiscard]] bool on_disk() const;
  // Errors: not_found.
  [[nodiscard]] Result<protocol::SavedView> find(const std::string& id) const;

  // Stores under a new id; never evicts. Errors: out_of_memory (views_max, bytes_max, disk full or
  // not writable), internal (disk failure).
  Result<protocol::SavedView> add(protocol::ViewDocument view, std::string created);

  // Decides whether the current view may be changed, and returns the new one or an error. Calls are
  // serialised.
  using Check = std::function<bool(const protocol::SavedView& now)>;
  using Change = std::function<Result<protocol::ViewDocument>(const protocol::ViewDocument& now)>;
  // nullopt if the change is not permitted. Errors: not_found, those of the change, those of add().
  Result<std::optional<protocol::SavedView>> replace(const std::string& id, const Check& may,
                                                     const Change& change);
  // False if not permitted. Errors: not_found, those of the disk as in add().
  Result<bool> remove(const std::string& id, const Check& may);

 private:
  struct State;
  explicit SavedViews(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::views
