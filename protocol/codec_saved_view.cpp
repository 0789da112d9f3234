// Saved views <-> JSON.
#include <algorithm>

#include "protocol/codec_json.hpp"
#include "protocol/saved_view.hpp"
#include "server/base/check.hpp"

namespace windsplat::protocol {
namespace {

constexpr std::string_view time_form = "0000-00-00T00:00:00Z";

Json saved_json(const SavedView& saved) {
  auto view = parse_json(saved.view.canonical());
  WINDSPLAT_CHECK(view.has_value());
  return Json{{"id", saved.id}, {"created", saved.created}, {"view", std::move(*view)}};
}

bool is_time(std::string_view text) {
  return std::equal(
      text.begin(), text.end(), time_form.begin(), time_form.end(),
      [](char c, char form) { return form == '0' ? c >= '0' && c <= '9' : c == form; });
}

}  // namespace

bool is_view_id(std::string_view text) {
  return text.size() == view_id_chars &&
         text.find_first_not_of(view_id_letters) == std::string_view::npos;
}

std::string encode_saved_view(const SavedView& saved, std::string_view kept) {
  Json out = saved_json(saved);
  out["kept"] = kept;
  return dump(out);
}

std::string encode_view_file(const SavedView& saved) { return dump(saved_json(saved)); }

Result<SavedView> parse_view_file(std::string_view json) {
  const auto tree = parse_json(json);
  if (!tree) return tree.error();
  Faults faults;
  ObjectReader reader(*tree, "", faults);
  SavedView saved;
  reader.text("id", saved.id, 1, Presence::required);
  reader.text("created", saved.created, 1, Presence::required);
  const Json* view = reader.child("view", Presence::required);
  reader.finish();
  if (faults.empty() && !is_view_id(saved.id))
    faults.add("/id", "must be a view id: 10 characters from 0 to 9 and a to z without i, l, o, u");
  if (faults.empty() && !is_time(saved.created)) {
    faults.add("/created", "must be a time of the form 2001-01-01T03:00:00Z");
  }
  if (!faults.empty()) return faults.error();
  auto document = ViewDocument::parse(view->dump());
  if (!document) return document.error();
  saved.view = std::move(*document);
  return saved;
}

}  // namespace windsplat::protocol
