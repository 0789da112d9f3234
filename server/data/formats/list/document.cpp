#include "server/data/formats/list/document.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/formats/plain/json_text.hpp"

namespace windsplat::data::list {

namespace {

using json_text::Json;
using json_text::Object;
using json_text::refuse;

constexpr std::size_t document_max = std::size_t{64} << 10;

std::string name_of(const Json& value, const std::string& pointer) {
  std::string name = Object::text_of(value, pointer);
  if (name.empty() || name.front() == '/' || name.find('\0') != std::string::npos) {
    refuse(pointer, "must be a name relative to the folder of the list");
  }
  for (std::string_view rest = name; !rest.empty();) {
    const std::size_t end = std::min(rest.find('/'), rest.size());
    if (rest.substr(0, end) == "..") refuse(pointer, "leads out of the folder of the list");
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return name;
}

// Entries of dimensions: numbers as their shortest decimal text.
Selection selection_of(const Json& value, const std::string& pointer) {
  if (!value.is_object() || value.size() > selection_max) {
    refuse(pointer,
           "must be an object of at most " + std::to_string(selection_max) + " dimensions");
  }
  Selection out;
  for (const auto& [name, entry] : value.items()) {
    const std::string at = pointer + '/' + printable(name, 40);
    std::string text;
    if (entry.is_number_integer()) {
      text = std::to_string(Object::integer_of(entry, at, INT64_MIN, INT64_MAX));
    } else if (entry.is_number()) {
      text = json_text::number_text(Object::number_of(entry, at));
    } else {
      text = Object::text_of(entry, at);
    }
    if (name.empty() || text.empty()) refuse(at, "must name an entry of a dimension");
    out.push_back({name, std::move(text)});
  }
  return out;
}

Document read(const Json& value) {
  const Object root(value, "", {"windsplat", "title", "files", "group", "selection"});
  if (root.text("windsplat", "files") != "files") refuse("/windsplat", "must be \"files\"");
  Document out;
  out.title = root.text("title", "");
  const Json& files = root.at("files");
  if (!files.is_array() || files.empty() || files.size() > parts_max) {
    refuse("/files", "must list 1 to " + std::to_string(parts_max) + " names or patterns");
  }
  for (const Json& entry : files) {
    out.files.push_back(name_of(entry, "/files/" + std::to_string(out.files.size())));
  }
  out.group = root.text("group", "");
  while (out.group.starts_with('/')) out.group.erase(0, 1);
  if (root.has("selection")) out.selection = selection_of(root.at("selection"), "/selection");
  return out;
}

}  // namespace

bool looks_like(std::string_view head) {
  constexpr std::string_view key = "\"windsplat\"";
  const std::size_t found = head.find(key);
  if (!trim(head).starts_with('{') || found == std::string_view::npos) return false;
  std::string_view rest = trim(head.substr(found + key.size()));
  if (!rest.starts_with(':')) return false;
  return trim(rest.substr(1)).starts_with("\"files\"");
}

Result<Document> parse_document(std::string_view text) {
  Document out;
  const auto parsed = json_text::parse(text, [&](const Json& value) { out = read(value); });
  if (!parsed) {
    return make_error(parsed.error().kind, "the list of files " + parsed.error().message);
  }
  return out;
}

Result<Document> parse_document(const InputFile& file) {
  if (file.size() > document_max) {
    return file.fault("is invalid: a list of files has at most " + std::to_string(document_max) +
                      " bytes");
  }
  const auto text = file.head(document_max);
  if (!text) return text.error();
  Document out;
  const auto parsed = json_text::parse(*text, [&](const Json& value) { out = read(value); });
  if (!parsed) return file.fault(parsed.error().message);
  return out;
}

}  // namespace windsplat::data::list
