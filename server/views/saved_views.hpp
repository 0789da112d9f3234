// Views that clients left here, under short ids: in memory and, where there is a folder, each in a
// file of its own. Checked views in, the same out.
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
  // The views are in its folder "views"; both are made where they are missing. Empty: memory alone.
  std::filesystem::path state_folder;
  std::size_t views_max = std::size_t{protocol::limits::views_max};
  std::size_t bytes_max = std::size_t{protocol::limits::views_bytes_max};  // of all as JSON
};

// Any thread. find() never waits for a disk; what changes views does, one at a time.
class SavedViews {
 public:
  // Reads what is there. Other files are logged and left alone, and so is a
  // folder that cannot be written to: its views are served, changes are refused. Errors: invalid,
  // where the folder cannot be used or another process does.
  static Result<std::shared_ptr<SavedViews>> open(Options options);
  ~SavedViews();
  SavedViews(const SavedViews&) = delete;
  SavedViews& operator=(const SavedViews&) = delete;

  [[nodiscard]] bool on_disk() const;
  // Errors: not_found.
  [[nodiscard]] Result<protocol::SavedView> find(const std::string& id) const;

  // Under a new id. None that is there gives way. Errors: out_of_memory (views_max, bytes_max, the
  // disk is full or cannot be written to), internal (the disk fails).
  Result<protocol::SavedView> add(protocol::ViewDocument view, std::string created);

  // Whether what is there now may be changed; and what it becomes, or why not. Nobody else changes
  // it meanwhile.
  using Check = std::function<bool(const protocol::SavedView& now)>;
  using Change = std::function<Result<protocol::ViewDocument>(const protocol::ViewDocument& now)>;
  // Empty where it may not be. Errors: not_found, those of the change, those of add().
  Result<std::optional<protocol::SavedView>> replace(const std::string& id, const Check& may,
                                                     const Change& change);
  // False where it may not be. Errors: not_found, those of the disk as in add().
  Result<bool> remove(const std::string& id, const Check& may);

 private:
  struct State;
  explicit SavedViews(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::views
