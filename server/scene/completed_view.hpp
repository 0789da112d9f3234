// A view with all defaults of its dataset filled in. Only completed views are drawn.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/place.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Made by complete() only. Immutable; independent of how long the dataset stays resident.
class CompletedView {
 public:
  [[nodiscard]] const protocol::View& view() const { return view_; }
  // The placement of the samples of the dataset for this view.
  [[nodiscard]] const std::shared_ptr<const Placed>& placed() const { return placed_; }
  [[nodiscard]] const Lattice& lattice() const { return placed_->lattice; }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  // Additional halvings of the data, if the view does not set the level of detail (detail.hpp,
  // coarser_level).
  [[nodiscard]] int coarser() const { return coarser_; }

  // The same view after change(protocol::View&), which may set the camera, the method, the size of
  // the picture and `quality`, or remove layers. Defaults that were filled in are kept. Errors:
  // invalid with a pointer (camera).
  template <class Change>
  [[nodiscard]] Result<CompletedView> with(const Change& change) const {
    CompletedView changed = *this;
    change(changed.view_);
    if (auto ok = changed.resolve(); !ok) return ok.error();
    return changed;
  }
  [[nodiscard]] CompletedView coarsened(int times) const {
    CompletedView changed = *this;
    changed.coarser_ = times;
    return changed;
  }
  // The level of the data is at least as coarse as this one, of a dataset with stored levels.
  [[nodiscard]] const std::array<int, 3>& least_level() const { return least_level_; }
  [[nodiscard]] CompletedView no_finer_than(const std::array<int, 3>& halvings) const {
    CompletedView changed = *this;
    changed.least_level_ = halvings;
    return changed;
  }

 private:
  friend Result<CompletedView> complete(const protocol::View& view, data::Dataset& dataset);
  CompletedView(protocol::View view, std::shared_ptr<const Placed> placed, const Camera& camera)
      : view_(std::move(view)), placed_(std::move(placed)), camera_(camera) {}
  Result<void> resolve();  // the camera

  protocol::View view_;
  std::shared_ptr<const Placed> placed_;
  Camera camera_;
  int coarser_ = 0;
  std::array<int, 3> least_level_{0, 0, 0};
};

// Fills in all defaults; values given by the view are kept. Loads only the data needed for ranges
// and placement, and none if the view gives them. Errors: invalid with a pointer (no such field,
// step or colour map; up parallel to the view direction; eye equal to target); those of loading.
Result<CompletedView> complete(const protocol::View& view, data::Dataset& dataset);

// Number of views completed in this process: tests compare it with the number of views drawn.
std::uint64_t completions();

// A view completed as far as the description of its dataset determines it, with a flat mapping:
// enough to validate it or to estimate its cost before data are read. Defaults that follow from
// data are not filled in.
struct ViewOutline {
  protocol::View view;
  Lattice lattice;
  Camera camera;
  bool bent = false;  // will be drawn on a bent lattice
};
// Loads nothing. Errors: those of complete() that need no data.
Result<ViewOutline> outline(const protocol::View& view, const data::Dataset& dataset);

// How many vectors the view leaves out by /vector/minMagnitude at the step from which defaults
// follow, which it names, for notes; empty: less than a hundredth. Errors: those of loading the
// field.
Result<std::string> hidden_vectors(const protocol::View& view, data::Dataset& dataset);

}  // namespace windsplat::scene
