// Common final steps of all readers of files.
#include "server/data/model/source.hpp"

#include "server/base/check.hpp"

namespace windsplat::data {

Result<Volume> FileSource::read(std::size_t field, std::size_t step) {
  const DatasetInfo& about = info();
  WINDSPLAT_CHECK(field < about.fields.size() && step < about.steps.size());
  Volume volume;
  volume.dims = about.grid.dims();
  volume.components = static_cast<int>(about.fields[field].components.size());
  volume.values = Samples(volume.samples() * about.fields[field].components.size());
  if (auto filled = fill(field, step, volume.values.data()); !filled) return filled.error();
  finish_volume(volume);
  return volume;
}

}  // namespace windsplat::data
