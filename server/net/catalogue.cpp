// Store -> descriptions, remembered once they were read.
#include "server/net/catalogue.hpp"

#include <utility>

#include "server/scene/build.hpp"
#include "server/scene/describe.hpp"

namespace windsplat::net {

Result<std::shared_ptr<data::Dataset>> Catalogue::find(const std::string& id) const {
  auto dataset = store_->find(id);
  if (!dataset) return make_error_at(ErrorKind::not_found, "/dataset", dataset.error().message);
  return dataset;
}

Result<std::vector<protocol::DatasetDescription>> Catalogue::list() const {
  std::vector<protocol::DatasetDescription> out;
  for (const auto& dataset : store_->all()) {
    {
      const std::lock_guard lock(mutex_);
      if (const auto known = described_.find(dataset->info().id); known != described_.end()) {
        out.push_back(known->second);
        out.back().resident_bytes = dataset->resident_bytes();
        continue;
      }
    }
    auto description = scene::describe(*dataset, scene::RangesOf::none);
    if (!description) return description.error();
    out.push_back(std::move(*description));
  }
  return out;
}

Result<protocol::DatasetDescription> Catalogue::describe(const std::string& id) {
  const auto dataset = find(id);
  if (!dataset) return dataset.error();
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = described_.find(id); known != described_.end()) {
      protocol::DatasetDescription description = known->second;
      description.resident_bytes = (*dataset)->resident_bytes();
      return description;
    }
  }
  auto description = scene::describe(**dataset, scene::RangesOf::first_step);
  if (description) {
    const std::lock_guard lock(mutex_);
    described_.insert_or_assign(id, *description);
  }
  return description;
}

Result<int> Catalogue::check(const protocol::View& view) const {
  const auto dataset = find(view.dataset);
  if (!dataset) return dataset.error();
  // A complete view is completed without loading: what would have to be read is filled in by
  // anything that is in order.
  protocol::View full = view;
  if (!full.vector.magnitude_range) full.vector.magnitude_range = protocol::Range{0, 1};
  if (!full.vector.min_magnitude) full.vector.min_magnitude = 0;
  if (!full.vector.color.range) full.vector.color.range = protocol::Range{0, 1};
  if (!full.scalars) full.scalars.emplace();
  for (protocol::ScalarView& scalar : *full.scalars) {
    if (!scalar.color.range) scalar.color.range = protocol::Range{0, 1};
    if (!scalar.extinction) scalar.extinction.emplace(1, std::array<double, 2>{0, 0});
  }
  // Bending the grid takes a while and perhaps a field: nobody may wait for that here.
  if (auto ok = scene::check_geometry(full.geometry, (*dataset)->info()); !ok) return ok.error();
  full.geometry.mapping = protocol::GeometryMapping::flat;
  full.geometry.height_field.reset();
  const auto completed = scene::complete_view(full, **dataset);
  if (!completed) return completed.error();
  return static_cast<int>((*dataset)->info().steps.size());
}

}  // namespace windsplat::net
