#include "protocol/view/codec_ground.hpp"

#include "protocol/codec_names.hpp"

namespace windsplat::protocol {

GroundView read_ground(const Json& json, const std::string& pointer, Faults& faults) {
  GroundView ground;
  ObjectReader reader(json, pointer, faults);
  reader.choice("show", ground.show, ground_show_names);
  reader.color("surfaceColor", ground.surface_color);
  reader.boolean("tint", ground.tint);
  reader.color("landColor", ground.land_color);
  reader.color("seaColor", ground.sea_color);
  reader.color("lineColor", ground.line_color);
  reader.boolean("coastlines", ground.coastlines);
  reader.boolean("borders", ground.borders);
  reader.boolean("graticule", ground.graticule);
  reader.finish();
  return ground;
}

Json ground_to_json(const GroundView& ground) {
  return Json{{"show", name_of(ground.show, ground_show_names)},
              {"surfaceColor", ground.surface_color},
              {"tint", ground.tint},
              {"landColor", ground.land_color},
              {"seaColor", ground.sea_color},
              {"lineColor", ground.line_color},
              {"coastlines", ground.coastlines},
              {"borders", ground.borders},
              {"graticule", ground.graticule}};
}

}  // namespace windsplat::protocol
