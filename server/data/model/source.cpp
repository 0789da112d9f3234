// Common final steps of all readers of files.
#include "server/data/model/source.hpp"

#include <string>

#include "server/base/check.hpp"

namespace windsplat::data {

Result<void> Source::check_part(std::size_t field, const StoredPart& part) const {
  const auto dims = stored_dims(info(), field, part.level, part.as);
  if (dims && is_within(part.box, *dims)) return {};
  const std::string level = part.level > 0 ? " of level " + std::to_string(part.level) : "";
  return make_error(ErrorKind::invalid, "the box " + key_of(part.box) + level +
                                            (dims ? " is beyond the grid" : " is not stored"));
}

Result<Volume> Source::read_part(std::size_t field, std::size_t step, const StoredPart& part) {
  if (auto fine = check_part(field, part); !fine) return fine.error();
  WINDSPLAT_CHECK(part.level == 0);
  const auto volume = read(field, step);
  if (!volume) return volume.error();
  return cut(*volume, part.box);
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

Result<Volume> FileSource::read_part(std::size_t field, std::size_t step, const StoredPart& part) {
  if (auto fine = check_part(field, part); !fine) return fine.error();
  const DatasetInfo& about = info();
  WINDSPLAT_CHECK(field < about.fields.size() && step < about.steps.size());
  if (!about.fields[field].is_read_by_boxes()) return Source::read_part(field, step, part);
  Volume volume;
  volume.dims = part.box.count;
  volume.components = components_of(about.fields[field], part.as);
  volume.values = Samples(volume.samples() * static_cast<std::size_t>(volume.components));
  const auto filled = fill_part(field, step, part, volume.values.data());
  if (!filled) return filled.error();
  WINDSPLAT_CHECK(*filled);
  mask_volume(volume.values.data(), volume.samples(), volume.components);
  if (measure_part(about, field, step, part.as, volume)) return volume;
  return make_error(ErrorKind::bad_data, "level " + std::to_string(part.level) + " of " +
                                             in_quotes(about.fields[field].name) +
                                             " has shares that are not between 0 and 1");
}

}  // namespace windsplat::data
