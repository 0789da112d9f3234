#include "server/tasks/view_completion.hpp"

namespace windsplat::tasks {

Result<scene::CompletedView> ViewCompletion::of(const protocol::View& view,
                                                data::Dataset& dataset) {
  {
    const std::lock_guard lock(mutex_);
    if (latest_ && latest_->view == view && latest_->info.lock().get() == &dataset.info() &&
        latest_->digest == dataset.digest()) {
      return latest_->completed;
    }
  }
  auto completed = frame::complete(view, dataset);
  if (!completed || scene::is_bent(view.geometry)) return completed;
  const std::lock_guard lock(mutex_);
  latest_.emplace(Latest{view, dataset.shared_info(), dataset.digest(), *completed});
  return completed;
}

}  // namespace windsplat::tasks
