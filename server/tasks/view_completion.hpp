// The completed form of the latest view, completed once for all work that needs it.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "server/data/resident/dataset.hpp"
#include "server/frame/frame.hpp"
#include "server/scene/completed_view.hpp"

namespace windsplat::tasks {

// Thread-safe. The lock is not held while a view is completed, which may wait for a file. Views on
// a bent lattice are not cached: their placement is as large as a field and is cached by the
// dataset.
class ViewCompletion {
 public:
  // Errors: those of frame::complete().
  Result<scene::CompletedView> of(const protocol::View& view, data::Dataset& dataset);

 private:
  struct Latest {
    protocol::View view;
    std::weak_ptr<const data::DatasetInfo> info;  // a reopened dataset has a new info
    std::string digest;                           // also of what the view subtracts
    scene::CompletedView completed;
  };
  std::mutex mutex_;
  std::optional<Latest> latest_;
};

}  // namespace windsplat::tasks
