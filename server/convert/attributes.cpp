#include "server/convert/attributes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "server/convert/coordinates.hpp"
#include "server/data/cf/written/attributes.hpp"

namespace windsplat::convert {

namespace {

using data::zarr::OrderedJson;

// Units by the names of UDUNITS, as OME-NGFF has them; empty: unknown.
std::string unit_name(const std::string& units) {
  static const std::map<std::string, std::string> names{{"m", "meter"},
                                                        {"metre", "meter"},
                                                        {"meters", "meter"},
                                                        {"meter", "meter"},
                                                        {"metres", "meter"},
                                                        {"km", "kilometer"},
                                                        {"kilometre", "kilometer"},
                                                        {"cm", "centimeter"},
                                                        {"mm", "millimeter"},
                                                        {"um", "micrometer"},
                                                        {"nm", "nanometer"},
                                                        {"degrees_east", "degree"},
                                                        {"degrees_north", "degree"},
                                                        {"degrees", "degree"},
                                                        {"degree", "degree"},
                                                        {"hPa", "hectopascal"},
                                                        {"Pa", "pascal"},
                                                        {"mbar", "millibar"},
                                                        {"millibar", "millibar"},
                                                        {"millibars", "millibar"},
                                                        {"s", "second"},
                                                        {"seconds", "second"},
                                                        {"second", "second"},
                                                        {"minutes", "minute"},
                                                        {"hours", "hour"},
                                                        {"hour", "hour"},
                                                        {"h", "hour"},
                                                        {"days", "day"},
                                                        {"day", "day"},
                                                        {"d", "day"}};
  const auto found = names.find(units.substr(0, units.find(" since ")));
  return found == names.end() ? "" : found->second;
}

// First value and mean spacing.
struct Spaced {
  double first = 0;
  double spacing = 1;
  bool even = true;
};

Spaced spaced(const std::vector<double>& values) {
  constexpr double rounding = 1e-6;
  Spaced out;
  if (values.empty()) return out;
  out.first = values.front();
  if (values.size() < 2) return out;
  out.spacing = (values.back() - values.front()) / static_cast<double>(values.size() - 1);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double at = out.first + static_cast<double>(i) * out.spacing;
    out.even = out.even && std::abs(values[i] - at) <= rounding * std::abs(out.spacing);
  }
  if (out.spacing == 0) out.spacing = 1;
  return out;
}

class Images {
 public:
  Images(const data::DatasetInfo& info, const Plan& plan) : info_(info), plan_(plan) {
    for (std::size_t level = 0; level < plan.levels.size(); ++level) {
      std::vector<std::vector<double>> axes(4);
      const auto names = dimension_names(info);
      for (const Coordinates& one : coordinates_of(info, plan, level)) {
        const auto at = std::ranges::find_if(names, [&](const std::string& name) {
          return one.array.path == std::to_string(level) + '/' + name;
        });
        if (at != names.end()) {
          axes[static_cast<std::size_t>(at - names.begin())] = one.values;
        }
      }
      for (const auto& values : axes) placed_.push_back(spaced(values));
    }
  }

  // Of the first version of the format that has this place of attributes, or that of Zarr 2.
  [[nodiscard]] OrderedJson list(const std::string& version) const {
    OrderedJson out = OrderedJson::array();
    for (const PlannedField& field : plan_.fields) {
      for (std::size_t c = 0; c < static_cast<std::size_t>(field.components); ++c) {
        out.push_back(image_of(field, c, version));
      }
    }
    return out;
  }

 private:
  [[nodiscard]] OrderedJson axes() const {
    OrderedJson out = OrderedJson::array();
    const auto names = dimension_names(info_);
    for (std::size_t i = 0; i < names.size(); ++i) {
      OrderedJson axis{{"name", names[i]}, {"type", i == 0 ? "time" : "space"}};
      const std::string unit =
          unit_name(i == 0 ? info_.time_units : info_.grid.axes.at(3 - i).units);
      if (!unit.empty()) axis["unit"] = unit;
      out.push_back(std::move(axis));
    }
    return out;
  }

  [[nodiscard]] OrderedJson image_of(const PlannedField& field, std::size_t component,
                                     const std::string& version) const {
    OrderedJson datasets = OrderedJson::array();
    for (const Product& product : field.products) {
      if (product.as != Reduced::samples && product.as != Reduced::mean &&
          product.as != Reduced::drawn) {
        continue;
      }
      OrderedJson scale = OrderedJson::array();
      OrderedJson translation = OrderedJson::array();
      bool even = true;
      for (std::size_t i = 0; i < 4; ++i) {
        const Spaced& at = placed_[4 * product.level + i];
        scale.push_back(at.spacing);
        translation.push_back(at.first);
        even = even && at.even;
      }
      OrderedJson transformations = OrderedJson::array();
      transformations.push_back({{"type", "scale"}, {"scale", std::move(scale)}});
      if (even) {
        transformations.push_back(
            {{"type", "translation"}, {"translation", std::move(translation)}});
      }
      datasets.push_back({{"path", plan_.arrays[product.arrays[component]].path},
                          {"coordinateTransformations", std::move(transformations)}});
    }
    OrderedJson out = OrderedJson::object();
    if (!version.empty()) out["version"] = version;
    out["name"] = info_.fields[field.index].components[component];
    out["axes"] = axes();
    out["datasets"] = std::move(datasets);
    return out;
  }

  const data::DatasetInfo& info_;
  const Plan& plan_;
  std::vector<Spaced> placed_;  // by level and dimension
};

OrderedJson windsplat_of(const data::DatasetInfo& info, const Plan& plan,
                         const std::vector<std::uint64_t>& bytes, const std::string& contents) {
  OrderedJson levels = OrderedJson::array();
  for (std::size_t n = 0; n < plan.levels.size(); ++n) {
    levels.push_back({{"path", std::to_string(n)},
                      {"halvings", plan.levels[n].how.halvings},
                      {"storedBytes", bytes.at(n)}});
  }
  OrderedJson fields = OrderedJson::array();
  for (const PlannedField& field : plan.fields) {
    OrderedJson components = OrderedJson::array();
    for (const std::size_t array : field.products.front().arrays) {
      components.push_back(plan.arrays[array].path.substr(2));  // after "0/"
    }
    const bool is_vector = info.fields[field.index].kind == data::FieldKind::vector;
    OrderedJson one{{"name", plain_name(field.name)},
                    {"components", std::move(components)},
                    {"levels", is_vector ? "drawn" : "two_values"}};
    if (is_vector) {
      one["strided"] = field.strided;
      if (!field.mean.empty()) one["mean"] = field.mean;
    }
    fields.push_back(std::move(one));
  }
  OrderedJson widths = OrderedJson::object();
  for (std::size_t a = 0; a < 3; ++a) {
    const std::string name = widths_name(info, plan, a);
    widths[std::string(1, "xyz"[a])] = name.empty() ? OrderedJson() : OrderedJson("0/" + name);
  }
  return {{"store", 1},
          {"program", "windsplat " WINDSPLAT_VERSION},
          {"source", info.source},
          {"contents", contents},
          {"levels", std::move(levels)},
          {"fields", std::move(fields)},
          {"widths", std::move(widths)},
          {"statistics", "statistics"},
          {"made",
           {{"fields", plan.identity.at("fields")},
            {"steps", plan.steps},
            {"compression", plan.compression_text}}}};
}

}  // namespace

OrderedJson root_attributes(const data::DatasetInfo& info, const Plan& plan,
                            const std::vector<std::uint64_t>& bytes, const std::string& contents) {
  const Images images(info, plan);
  OrderedJson out = OrderedJson::object();
  if (!info.title.empty()) out["title"] = info.title;
  if (plan.format == data::zarr::StoreFormat::v3) {
    out["ome"] = {{"version", "0.5"}, {"multiscales", images.list("")}};
  } else {
    out["multiscales"] = images.list("0.4");
  }
  out["windsplat"] = windsplat_of(info, plan, bytes, contents);
  return out;
}

std::vector<data::zarr::WrittenGroup> level_groups(const data::DatasetInfo& info,
                                                   const Plan& plan) {
  std::vector<data::zarr::WrittenGroup> out;
  for (std::size_t n = 0; n < plan.levels.size(); ++n) {
    data::zarr::WrittenGroup group;
    group.path = std::to_string(n);
    for (const auto& [name, text] : data::cf::dataset_attributes(info)) {
      group.attributes[name] = text;
    }
    out.push_back(std::move(group));
  }
  return out;
}

}  // namespace windsplat::convert
