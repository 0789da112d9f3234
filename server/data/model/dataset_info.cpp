// Sizes of a grid; fields by name or kind.
#include "server/data/model/dataset_info.hpp"

#include <algorithm>

#include "server/base/error.hpp"
#include "server/base/nearest_word.hpp"

namespace windsplat::data {

std::array<int, 3> Grid::dims() const {
  std::array<int, 3> out{};
  for (std::size_t a = 0; a < 3; ++a) {
    out[a] = static_cast<int>(axes[a].coordinates.size());
  }
  return out;
}

std::size_t Grid::samples() const {
  return axes[0].coordinates.size() * axes[1].coordinates.size() * axes[2].coordinates.size();
}

const FieldInfo* DatasetInfo::find(const std::string& name) const {
  const auto at = std::find_if(fields.begin(), fields.end(),
                               [&](const FieldInfo& field) { return field.name == name; });
  return at == fields.end() ? nullptr : &*at;
}

const FieldInfo* DatasetInfo::first(FieldKind kind) const {
  const auto at = std::find_if(fields.begin(), fields.end(),
                               [&](const FieldInfo& field) { return field.kind == kind; });
  return at == fields.end() ? nullptr : &*at;
}

namespace {

// The field that may be meant, or those that there are.
std::string known_fields(const DatasetInfo& info, const std::string& name) {
  constexpr std::size_t names_shown_max = 40;
  constexpr std::size_t name_shown_max = 60;  // bytes
  std::vector<std::string> names;
  for (const FieldInfo& field : info.fields) names.push_back(field.name);
  if (std::string meant = did_you_mean(name, names); !meant.empty()) return meant;
  std::string list;
  for (std::size_t n = 0; n < std::min(names.size(), names_shown_max); ++n) {
    list += (n > 0 ? ", " : "; fields: ") + printable(names[n], name_shown_max);
  }
  if (names.size() <= names_shown_max) return list;
  return list + " and " + std::to_string(names.size() - names_shown_max) + " more";
}

}  // namespace

std::string absence_text(const DatasetInfo& info, const std::string& name) {
  const auto left = std::find_if(info.left_out.begin(), info.left_out.end(),
                                 [&](const LeftOut& one) { return one.name == name; });
  if (left == info.left_out.end()) return known_fields(info, name);
  constexpr std::size_t shown_max = 200;
  if (!left->reason.starts_with("on another grid")) {
    return ": it is left out, " + printable(left->reason, shown_max);
  }
  return ": it lies " + printable(left->reason, shown_max) +
         "; to show it, append ?field=" + printable(name, shown_max) +
         " to the file's name (&field= behind other entries)";
}

void bound_notes(std::size_t notes_of_file, std::vector<std::string>& notes) {
  if (notes.size() <= notes_of_data_max) return;
  const std::size_t more = notes.size() - notes_of_data_max + 1;
  const std::size_t of_file = std::min(more, notes_of_file);
  const auto end = notes.begin() + static_cast<std::ptrdiff_t>(notes_of_file);
  notes.erase(end - static_cast<std::ptrdiff_t>(of_file), end);
  notes.resize(notes_of_data_max - 1);
  notes.push_back(std::to_string(more) + " more notes");
}

}  // namespace windsplat::data
