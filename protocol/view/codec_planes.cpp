#include "protocol/view/codec_planes.hpp"

#include <cmath>

#include "protocol/codec_names.hpp"
#include "protocol/limits.hpp"

namespace windsplat::protocol {

namespace {

constexpr NumberRange world_places{-limits::world_max, limits::world_max};

}  // namespace

std::string number_text(double value) { return dump(canonical_number(value)); }

void check_direction(const Vec3& direction, const std::string& pointer, Faults& faults) {
  if (std::hypot(direction[0], direction[1], direction[2]) < limits::up_length_min) {
    faults.add(pointer,
               "must be a direction of length " + number_text(limits::up_length_min) + " or more");
  }
}

void check_color_range(const std::optional<Range>& range, ObjectReader& reader) {
  if (range && !(std::abs((*range)[1] - (*range)[0]) >= limits::range_width_min)) {
    reader.faults().add(reader.at("range"), "must have ends that differ by at least " +
                                                number_text(limits::range_width_min));
  }
}

SliceView read_slice(const Json& json, const std::string& pointer, Faults& faults) {
  SliceView slice;
  ObjectReader reader(json, pointer, faults);
  reader.choice("axis", slice.axis, axis_names, Presence::required);
  if (const Json* index = reader.child("index", Presence::required)) {
    const auto read = read_number(*index, reader.at("index"),
                                  {0, static_cast<double>(limits::slice_index_max)}, faults);
    if (read) slice.index = *read;
  }
  reader.finish();
  return slice;
}

PlaneView read_plane(const Json& json, const std::string& pointer, Faults& faults) {
  PlaneView plane;
  ObjectReader reader(json, pointer, faults);
  if (reader.child("point", Presence::required)) reader.numbers("point", plane.point, world_places);
  if (reader.child("normal", Presence::required))
    reader.numbers("normal", plane.normal, world_places);
  reader.finish();
  check_direction(plane.normal, reader.at("normal"), faults);
  return plane;
}

Json slice_to_json(const std::optional<SliceView>& slice) {
  if (!slice) return {};
  return {{"axis", name_of(slice->axis, axis_names)}, {"index", canonical_number(slice->index)}};
}

Json plane_to_json(const std::optional<PlaneView>& plane) {
  if (!plane) return {};
  return {{"point", numbers_to_json(plane->point)}, {"normal", numbers_to_json(plane->normal)}};
}

}  // namespace windsplat::protocol
