// Describes views, measures time and error of each setting for those at rest, and stores both in
// the tables.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/frame/content.hpp"
#include "server/tasks/backend.hpp"
#include "server/tasks/view_completion.hpp"

namespace windsplat::tasks {

// On a thread that may block, computes what the view shows from its resident data, and prepares the
// levels of coarser settings; then draws every setting while the renderer is idle. Nothing is drawn
// if the tables cover the scene near this viewpoint or the picture is small. Ends once `unwanted`
// is raised, even within the description. Never evicts data of prefetch requests.
void submit_calibration(Backend& backend, std::uint64_t owner, const protocol::View& view,
                        const std::shared_ptr<ViewCompletion>& completion,
                        const CancelToken& unwanted);

// A view of the dataset was described, which took that long: for the metrics and for deciding
// whether a budget allows another one. 0: nothing was described.
void learn_describing(Backend& backend, const std::string& dataset, std::int64_t took_us);

// frame::described() with the tables of the server.
frame::Described describe_view(Backend& backend, const scene::CompletedView& completed,
                               const scene::Scene& scene, const CancelToken& cancel);
frame::Described describe_view(Backend& backend, const scene::CompletedView& completed,
                               const data::Dataset& dataset, const CancelToken& cancel);

}  // namespace windsplat::tasks
