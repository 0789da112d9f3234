// Common final steps of all readers of files.
#include "server/data/model/source.hpp"

#include "server/base/check.hpp"

namespace windsplat::data {

Result<void> Source::check_box(const Box& box) const {
  if (is_within(box, info().grid.dims())) return {};
  return make_error(ErrorKind::invalid, "the box " + key_of(box) + " is beyond the grid");
}

Result<Volume> Source::read_part(std::size_t field, std::size_t step, const Box& box) {
  if (auto fine = check_box(box); !fine) return fine.error();
  const auto volume = read(field, step);
  if (!volume) return volume.error();
  return cut(*volume, box);
}

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

Result<Volume> FileSource::read_part(std::size_t field, std::size_t step, const Box& box) {
  if (auto fine = check_box(box); !fine) return fine.error();
  const DatasetInfo& about = info();
  WINDSPLAT_CHECK(field < about.fields.size() && step < about.steps.size());
  if (!about.fields[field].is_read_by_boxes()) return Source::read_part(field, step, box);
  Volume volume;
  volume.dims = box.count;
  volume.components = static_cast<int>(about.fields[field].components.size());
  volume.values = Samples(box.samples() * about.fields[field].components.size());
  const auto filled = fill_part(field, step, box, volume.values.data());
  if (!filled) return filled.error();
  WINDSPLAT_CHECK(*filled);
  finish_volume(volume);
  return volume;
}

}  // namespace windsplat::data
