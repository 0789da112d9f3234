#include "server/data/formats/zarr/levels/names.hpp"

#include <string_view>
#include <utility>

#include "server/data/formats/zarr/nodes.hpp"
#include "server/data/model/stored.hpp"

namespace windsplat::data::zarr {

namespace {

constexpr std::int64_t version_max = 1;
constexpr std::size_t fields_max = 4096;

Error wrong(const std::string& what) {
  return make_error(ErrorKind::bad_data, "the attribute 'windsplat': " + what);
}

const std::vector<Json>* list_at(const Json& json, std::string_view key) {
  const Json* const found = json.find(key);
  return found != nullptr && found->kind == Json::Kind::list ? &found->list : nullptr;
}

Result<int> small_number(const Json* json, int most, const std::string& what) {
  if (json == nullptr || !json->is_integer || json->integer < 0 || json->integer > most) {
    return wrong(what + " is not an integer from 0 to " + std::to_string(most));
  }
  return static_cast<int>(json->integer);
}

Result<LevelNames::Level> level_at(const Json& json, const std::string& place) {
  LevelNames::Level out;
  out.path = json.text_at("path");
  if (!is_plain_path(out.path)) return wrong(place + "/path is not the path of a group");
  const auto* const halvings = list_at(json, "halvings");
  if (halvings == nullptr || halvings->size() != 3) {
    return wrong(place + "/halvings is not a list of three");
  }
  for (std::size_t a = 0; a < 3; ++a) {
    const auto h = small_number(&(*halvings)[a], stored_halvings_max,
                                place + "/halvings/" + std::to_string(a));
    if (!h) return h.error();
    out.halvings.at(a) = *h;
  }
  if (const Json* const bytes = json.find("storedBytes")) {
    if (!bytes->is_integer || bytes->integer < 0) {
      return wrong(place + "/storedBytes is not a number of bytes");
    }
    out.bytes = static_cast<std::uint64_t>(bytes->integer);
  }
  return out;
}

Result<LevelNames::Field> field_at(const Json& json, const std::string& place,
                                   const std::string& statistics) {
  LevelNames::Field out;
  const std::string name = json.text_at("name");
  if (!is_plain_name(name)) return wrong(place + "/name is not a name");
  if (!statistics.empty()) out.ranges = statistics + '/' + name;
  const auto* const components = list_at(json, "components");
  if (components == nullptr || components->empty() || components->size() > 3) {
    return wrong(place + "/components is not a list of one to three names");
  }
  for (const Json& one : *components) {
    if (!is_plain_name(one.text)) return wrong(place + "/components has what is not a name");
    out.components.push_back(one.text);
  }
  const Json* const levels = json.find("levels");
  if (levels != nullptr && levels->kind != Json::Kind::null) {
    const bool is_vector = out.components.size() > 1;
    if (levels->text != (is_vector ? "drawn" : "two_values")) {
      return wrong(place + "/levels is not \"" + (is_vector ? "drawn" : "two_values") + "\"");
    }
    out.as = is_vector ? LevelNames::Field::As::drawn : LevelNames::Field::As::two_values;
  }
  if (const Json* const strided = json.find("strided")) {
    const auto count = small_number(strided, strided_levels_max, place + "/strided");
    if (!count) return count.error();
    out.strided = *count;
  }
  return out;
}

Result<void> add_widths(const Json& json, LevelNames& out) {
  constexpr std::array axes{"x", "y", "z"};
  const Json* const widths = json.find("widths");
  for (std::size_t a = 0; a < 3 && widths != nullptr; ++a) {
    const Json* const one = widths->find(axes.at(a));
    if (one == nullptr || one->kind == Json::Kind::null) continue;
    if (!is_plain_path(one->text)) {
      return wrong(std::string("/widths/") + axes.at(a) + " is not the path of an array");
    }
    out.widths.at(a) = one->text;
  }
  return {};
}

}  // namespace

Result<std::optional<LevelNames>> level_names(const Json& attributes) {
  const Json* const json = attributes.find("windsplat");
  const Json* const version = json == nullptr ? nullptr : json->find("store");
  if (version == nullptr) return std::optional<LevelNames>();
  if (!version->is_integer || version->integer < 1) return wrong("/store is not a version");
  if (version->integer > version_max) {
    std::string program = json->text_at("program");
    if (program.empty()) program = "a later program";
    return wrong("version " + std::to_string(version->integer) + " needs " +
                 printable(program, 100) + " or later; this is " WINDSPLAT_VERSION);
  }
  LevelNames out;
  out.contents = json->text_at("contents");
  const auto* const levels = list_at(*json, "levels");
  if (levels == nullptr || levels->empty() || levels->size() > stored_levels_max) {
    return wrong("/levels is not a list of 1 to " + std::to_string(stored_levels_max));
  }
  for (std::size_t n = 0; n < levels->size(); ++n) {
    auto level = level_at((*levels)[n], "/levels/" + std::to_string(n));
    if (!level) return level.error();
    out.levels.push_back(std::move(*level));
  }
  const std::string statistics = json->text_at("statistics");
  if (!statistics.empty() && !is_plain_path(statistics)) {
    return wrong("/statistics is not the path of a group");
  }
  const auto* const fields = list_at(*json, "fields");
  if (fields == nullptr || fields->size() > fields_max) {
    return wrong("/fields is not a list of at most " + std::to_string(fields_max));
  }
  for (std::size_t n = 0; n < fields->size(); ++n) {
    auto field = field_at((*fields)[n], "/fields/" + std::to_string(n), statistics);
    if (!field) return field.error();
    if (field->strided >= static_cast<int>(out.levels.size())) {
      return wrong("/fields/" + std::to_string(n) + "/strided is beyond the last level");
    }
    out.fields.push_back(std::move(*field));
  }
  if (auto done = add_widths(*json, out); !done) return done.error();
  return std::optional(std::move(out));
}

std::vector<std::string> level_paths(const LevelNames& names, const LevelNames::Field& field,
                                     std::size_t level, bool strided) {
  std::vector<std::string> out;
  const std::string group = names.levels.at(level).path + '/';
  if (field.as == LevelNames::Field::As::two_values) {
    for (const char* const value : {"_low", "_high", "_low_share", "_high_share"}) {
      out.push_back(group + field.components[0] + value);
    }
    return out;
  }
  for (const std::string& component : field.components) {
    out.push_back(group + component + (strided ? "_strided" : ""));
  }
  return out;
}

std::string range_path(const LevelNames::Field& field) { return field.ranges + "_range"; }
std::string masked_path(const LevelNames::Field& field) { return field.ranges + "_masked"; }

}  // namespace windsplat::data::zarr
