// ViewDocument: a view as written by the user -> validated canonical text, edited by merge patch or
// pointer.
#include "protocol/codec.hpp"
#include "protocol/codec_json.hpp"
#include "protocol/limits.hpp"
#include "server/base/check.hpp"

namespace windsplat::protocol {

namespace {

constexpr std::string_view kept_null_parent = "/vector";
constexpr std::string_view kept_null_key = "field";

bool keeps_null(const std::string& pointer, const std::string& key) {
  return key == kept_null_key && pointer == kept_null_parent;
}

// Objects whose absence means something else than their defaults.
bool keeps_empty(const std::string& pointer, const std::string& key) {
  return (key == "light" && pointer.empty()) || (key == "trace" && pointer == "/vector") ||
         (key == "seeds" && pointer == "/vector/trace");
}

// Removes redundant parts: nulls that mean a default, and empty objects.
void remove_unsaid(Json& value, const std::string& pointer) {
  if (value.is_array()) {
    for (Json& element : value) remove_unsaid(element, pointer + "/-");
    return;
  }
  if (!value.is_object()) return;
  for (auto member = value.begin(); member != value.end();) {
    remove_unsaid(*member, join_pointer(pointer, member.key()));
    const bool unsaid =
        (member->is_null() && !keeps_null(pointer, member.key())) ||
        (member->is_object() && member->empty() && !keeps_empty(pointer, member.key()));
    member = unsaid ? value.erase(member) : std::next(member);
  }
}

// RFC 7396, section 2, except for the stored null. Depth is bounded by the parser.
void merge(Json& target, const Json& patch, const std::string& pointer) {
  if (!patch.is_object()) {
    target = patch;
    return;
  }
  if (!target.is_object()) target = Json::object();
  for (const auto& member : patch.items()) {
    if (member.value().is_null() && !keeps_null(pointer, member.key())) {
      target.erase(member.key());
    } else {
      merge(target[member.key()], member.value(), join_pointer(pointer, member.key()));
    }
  }
}

// Reference tokens of an RFC 6901 pointer, unescaped.
Result<std::vector<std::string>> split_pointer(std::string_view pointer) {
  std::vector<std::string> tokens;
  if (!pointer.empty() && pointer[0] != '/') {
    return make_error(ErrorKind::invalid, "a JSON pointer begins with '/': " + printable(pointer));
  }
  for (std::size_t i = 0; i < pointer.size(); ++i) {
    if (pointer[i] == '/') {
      tokens.emplace_back();
    } else if (pointer[i] != '~') {
      tokens.back() += pointer[i];
    } else {
      const char escape = i + 1 < pointer.size() ? pointer[++i] : ' ';
      if (escape != '0' && escape != '1') {
        return make_error(ErrorKind::invalid, "JSON pointer " + printable(pointer) +
                                                  ": '~' must be followed by 0 or 1");
      }
      tokens.back() += escape == '0' ? '~' : '/';
    }
  }
  if (tokens.size() >= limits::json_depth_max) {
    return make_error(ErrorKind::invalid, "the JSON pointer has " + std::to_string(tokens.size()) +
                                              " parts; the limit is " +
                                              std::to_string(limits::json_depth_max - 1));
  }
  return tokens;
}

// The element of an array selected by a token; the position after the last, also written "-",
// appends an element.
Json* element_at(Json& array, const std::string& token) {
  if (token == "-") return &array.emplace_back();
  const bool digits = !token.empty() && token.size() <= 3 &&
                      token.find_first_not_of("0123456789") == std::string::npos &&
                      (token == "0" || token[0] != '0');
  if (!digits) return nullptr;
  const std::size_t index = std::stoul(token);
  if (index > array.size()) return nullptr;
  return index == array.size() ? &array.emplace_back() : &array[index];
}

Result<ViewDocument> checked_document(const Json& json) {
  try {
    return ViewDocument::parse(json.dump());
  } catch (const Json::type_error&) {  // a string from the command line with invalid UTF-8
    return make_error(ErrorKind::malformed, "the text of a view must be valid UTF-8");
  }
}

}  // namespace

Result<ViewDocument> ViewDocument::parse(std::string_view json) {
  auto tree = parse_json(json);
  if (!tree) return tree.error();
  Faults faults;
  read_view(*tree, faults);
  if (!faults.empty()) return faults.error();
  remove_unsaid(*tree, "");
  make_numbers_canonical(*tree);
  ViewDocument document;
  document.json_ = dump(*tree);
  return document;
}

Result<ViewDocument> ViewDocument::patched(std::string_view patch_json) const {
  const auto patch = parse_json(patch_json);
  if (!patch) return patch.error();
  auto tree = parse_json(json_);
  if (!tree) return tree.error();
  merge(*tree, *patch, "");
  return checked_document(*tree);
}

View ViewDocument::view() const {
  const auto tree = parse_json(json_);
  WINDSPLAT_CHECK(tree.has_value());
  Faults faults;
  View view = read_view(*tree, faults);
  WINDSPLAT_CHECK(faults.empty());
  return view;
}

namespace {

Result<void> put(Json& tree, std::string_view pointer, std::string_view value) {
  const auto tokens = split_pointer(pointer);
  if (!tokens) return tokens.error();
  Json* target = &tree;
  std::string at;
  for (const std::string& token : *tokens) {
    const bool starts_array = token == "0" || token == "-";
    if (target->is_null()) *target = starts_array ? Json::array() : Json::object();
    if (target->is_array()) {
      target = element_at(*target, token);
      if (target == nullptr) {
        return make_error_at(ErrorKind::invalid, join_pointer(at, token),
                             "is neither an element of this array nor the position after the last");
      }
    } else if (target->is_object()) {
      target = &(*target)[token];
    } else {
      return make_error_at(ErrorKind::invalid, join_pointer(at, token),
                           "is within " + described(*target) + ", which is not a container");
    }
    at = join_pointer(at, token);
  }
  auto parsed = parse_json(value);
  *target = parsed ? std::move(*parsed) : Json(std::string(value));
  return {};
}

}  // namespace

Result<ViewDocument> set_all(const ViewDocument& document,
                             const std::vector<std::pair<std::string, std::string>>& changes) {
  auto tree = parse_json(document.canonical());
  if (!tree) return tree.error();
  for (const auto& [pointer, value] : changes) {
    if (auto done = put(*tree, pointer, value); !done) return done.error();
  }
  return checked_document(*tree);
}

Result<ViewDocument> set_at(const ViewDocument& document, std::string_view pointer,
                            std::string_view value) {
  return set_all(document, {{std::string(pointer), std::string(value)}});
}

std::string view_text(const std::optional<std::string>& step,
                      const std::optional<std::string>& width,
                      const std::optional<std::string>& height) {
  std::string image;
  if (width) image += "\"width\":" + *width;
  if (height) image += (image.empty() ? "\"height\":" : ",\"height\":") + *height;
  std::string json = "{\"image\":{" + image + '}';
  if (step) json += ",\"step\":" + *step;
  return json + '}';
}

std::string step_patch(int step) { return dump(Json{{"step", step}}); }

std::string dataset_patch(const std::string& dataset) {
  Json patch{{"dataset", dataset}};
  for (const char* key : {"step", "difference", "camera", "geometry", "vector", "scalars",
                          "depthCue", "method", "surfaces", "region", "light", "ground"}) {
    patch[key] = nullptr;
  }
  patch["annotations"] = Json{{"titleText", nullptr}};
  return dump(patch);
}

}  // namespace windsplat::protocol
