// JSON with limits on size and depth; rejects duplicate and unknown keys and checks every number.
#include "server/data/formats/raw/document.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

#include "server/data/formats/plain/json_text.hpp"

namespace windsplat::data::raw {

namespace {

using json = json_text::Json;
using json_text::Object;
using json_text::refuse;

constexpr std::size_t document_max = std::size_t{4} << 20;
constexpr std::int64_t axis_max = std::int64_t{1} << 24;
constexpr std::int64_t steps_max = 10'000'000;
constexpr std::size_t fields_max = 1024;
constexpr std::size_t files_max = 100'000;
constexpr std::array<const char*, 3> letters{"x", "y", "z"};

FileNames files_of(const json& value, const std::string& pointer) {
  FileNames out;
  if (value.is_array()) {
    if (value.empty() || value.size() > files_max) {
      refuse(pointer, "must name 1 to " + std::to_string(files_max) + " files");
    }
    for (const json& entry : value) {
      out.names.push_back(Object::text_of(entry, pointer + '/' + std::to_string(out.names.size())));
    }
    return out;
  }
  out.names.push_back(Object::text_of(value, pointer));
  out.pattern = out.names.front().find('%') != std::string::npos;
  return out;
}

void set_type(const Object& object, Field& field, const Field& otherwise, bool needed) {
  field.type = otherwise.type;
  field.big_endian = otherwise.big_endian;
  if (needed || object.has("type")) {
    const auto type = bytes::scalar_named(Object::text_of(object.at("type"), object.below("type")));
    if (!type) {
      refuse(object.below("type"),
             "must be int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32 or "
             "float64");
    }
    field.type = *type;
  }
  if (object.has("endian") || (needed && bytes::size_of(field.type) > 1)) {
    const std::string endian = Object::text_of(object.at("endian"), object.below("endian"));
    if (endian != "little" && endian != "big") {
      refuse(object.below("endian"), "must be little or big");
    }
    field.big_endian = endian == "big";
  }
}

constexpr std::int64_t offset_max = std::int64_t{1} << 60;

Field field_of(const json& value, const std::string& pointer, const Field& defaults) {
  const Object object(
      value, pointer,
      {"name", "components", "units", "layout", "missing", "type", "endian", "file", "offset"});
  Field out;
  out.name = Object::text_of(object.at("name"), object.below("name"));
  if (out.name.empty()) refuse(object.below("name"), "must not be empty");
  out.units = object.text("units", "");
  set_type(object, out, defaults, false);
  const std::string layout = object.text("layout", "interleaved");
  if (layout != "interleaved" && layout != "planar") {
    refuse(object.below("layout"), "must be interleaved or planar");
  }
  out.planar = layout == "planar";
  if (object.has("components")) {
    const json& names = object.at("components");
    const std::string where = object.below("components");
    if (!names.is_array() || names.size() < 2 || names.size() > 3) {
      refuse(where, "must name 2 or 3 components");
    }
    for (const json& name : names) {
      out.components.push_back(
          Object::text_of(name, where + '/' + std::to_string(out.components.size())));
    }
  }
  if (object.has("missing")) {
    const json& missing = object.at("missing");
    out.missing = missing.is_array() ? Object::numbers_of(missing, object.below("missing"), 64)
                                     : std::vector<double>{object.number("missing", 0)};
  }
  if (object.has("file")) {
    out.files = files_of(object.at("file"), object.below("file"));
    out.offset = static_cast<std::uint64_t>(object.integer("offset", 0, offset_max, 0));
  } else if (object.has("offset")) {
    refuse(object.below("offset"), "an offset requires a separate file for the field");
  }
  return out;
}

AxisText axis_of(const json& value, const std::string& pointer, std::size_t count) {
  const Object object(value, pointer, {"units", "positive", "first", "spacing", "coordinates"});
  AxisText out;
  out.places.count = count;
  out.units = object.text("units", "");
  out.positive = object.text("positive", "");
  if (!out.positive.empty() && out.positive != "up" && out.positive != "down") {
    refuse(object.below("positive"), "must be up or down");
  }
  if (object.has("coordinates")) {
    auto& listed = out.places.listed;
    listed = Object::numbers_of(object.at("coordinates"), object.below("coordinates"), count);
    if (listed.size() != count) {
      refuse(object.below("coordinates"), "must have " + std::to_string(count) + " numbers, has " +
                                              std::to_string(listed.size()));
    }
    if (object.has("first") || object.has("spacing")) {
      refuse(pointer, "coordinates exclude first and spacing");
    }
    return out;
  }
  out.places.first = object.number("first", 0);
  out.places.step = object.number("spacing", 1);
  if (out.places.step == 0) refuse(object.below("spacing"), "must not be 0");
  return out;
}

void set_dims(const Object& root, Document& out) {
  const Object dims(root.at("dims"), root.below("dims"), {"x", "y", "z"});
  for (std::size_t a = 0; a < 3; ++a) {
    out.has.at(a) = a < 2 || dims.has(letters.at(a));
    if (out.has.at(a)) {
      out.dims.at(a) = static_cast<std::size_t>(dims.integer(letters.at(a), 1, axis_max));
    }
  }
  const std::string all = out.has[2] ? "zyx" : "yx";
  out.order = root.text("order", all);
  if (!std::is_permutation(out.order.begin(), out.order.end(), all.begin(), all.end())) {
    refuse(root.below("order"), "must name each dimension once, the slowest first, as in " + all);
  }
}

void set_axes(const Object& root, Document& out) {
  if (!root.has("axes")) return;
  const Object axes(root.at("axes"), root.below("axes"), {"x", "y", "z"});
  for (std::size_t a = 0; a < 3; ++a) {
    if (!axes.has(letters.at(a))) continue;
    if (!out.has.at(a)) refuse(axes.below(letters.at(a)), "unknown dimension");
    out.axes.at(a) = axis_of(axes.at(letters.at(a)), axes.below(letters.at(a)), out.dims.at(a));
  }
}

void set_steps(const Object& root, Document& out) {
  out.times.count = 1;
  if (!root.has("steps")) return;
  const Object steps(root.at("steps"), root.below("steps"),
                     {"count", "start", "step", "units", "calendar", "coordinates"});
  const auto count = static_cast<std::size_t>(steps.integer("count", 1, steps_max));
  out.times.count = count;
  out.time_units = steps.text("units", "");
  out.calendar = steps.text("calendar", "");
  if (steps.has("coordinates")) {
    auto& listed = out.times.listed;
    listed = Object::numbers_of(steps.at("coordinates"), steps.below("coordinates"), count);
    if (listed.size() != count || steps.has("start") || steps.has("step")) {
      refuse(steps.below("coordinates"), "must have count numbers and excludes start and step");
    }
    return;
  }
  out.times.first = steps.number("start", 0);
  out.times.step = steps.number("step", 1);
}

void set_fields(const Object& root, Document& out, const Field& defaults) {
  const json& fields = root.at("fields");
  const std::string where = root.below("fields");
  if (!fields.is_array() || fields.empty() || fields.size() > fields_max) {
    refuse(where, "must be a list of 1 to " + std::to_string(fields_max) + " fields");
  }
  std::set<std::string> names;
  for (const json& value : fields) {
    const std::string here = where + '/' + std::to_string(out.fields.size());
    out.fields.push_back(field_of(value, here, defaults));
    const Field& field = out.fields.back();
    std::vector<std::string> own = field.components;
    if (own.empty()) own.push_back(field.name);
    for (const std::string& name : own) {
      if (name.empty() || !names.insert(name).second) {
        refuse(here, "the name " + in_quotes(name) + " is empty or occurs twice");
      }
    }
    if (field.files.names.empty() && out.files.names.empty()) {
      refuse(here + "/file", "is required, because the document has no file");
    }
  }
}

Document read(const json& value) {
  const Object root(value, "",
                    {"windsplat", "title", "file", "numbers", "steps_per_file", "dims", "order",
                     "type", "endian", "offset", "steps", "axes", "fields"});
  Document out;
  if (Object::text_of(root.at("windsplat"), "/windsplat") != "raw") {
    refuse("/windsplat", "must be raw");
  }
  out.title = root.text("title", "");
  if (root.has("file")) out.files = files_of(root.at("file"), "/file");
  constexpr std::int64_t far = 1'000'000'000'000;
  if (root.has("numbers")) {
    const Object numbers(root.at("numbers"), "/numbers", {"first", "step"});
    out.first_number = numbers.integer("first", -far, far, 0);
    out.number_step = numbers.integer("step", -1'000'000, 1'000'000, 1);
    if (out.number_step == 0) refuse("/numbers/step", "must not be 0");
  }
  out.steps_per_file = static_cast<std::size_t>(root.integer("steps_per_file", 1, steps_max, 0));
  out.offset = static_cast<std::uint64_t>(root.integer("offset", 0, offset_max, 0));
  Field defaults;
  set_type(root, defaults, defaults, true);
  set_dims(root, out);
  set_axes(root, out);
  set_steps(root, out);
  set_fields(root, out, defaults);
  return out;
}

}  // namespace

Result<Document> parse_document(const InputFile& file) {
  if (file.size() > document_max) {
    return file.fault("is invalid: a description has at most " + std::to_string(document_max) +
                      " bytes");
  }
  const auto text = file.head(document_max);
  if (!text) return text.error();
  Document out;
  const auto parsed = json_text::parse(*text, [&](const json& value) { out = read(value); });
  if (!parsed) return file.fault(parsed.error().message);
  return out;
}

}  // namespace windsplat::data::raw
