// Converts a path or pattern to a Location: resolves links, matches patterns and sorts names.
#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/files/files.hpp"
#include "server/data/files/locate_parts.hpp"
#include "server/data/files/pattern.hpp"
#include "server/data/files/url.hpp"

namespace windsplat::data {

namespace {

namespace fs = std::filesystem;

// Extensions of formats whose headers name companion files.
constexpr auto with_companions = std::to_array<std::string_view>(
    {".pvd", ".ctl", ".json", ".nhdr", ".dx", ".foam", ".openfoam", ".case", ".encas", ".pvti",
     ".pvtr", ".pvts", ".pvtu", ".vtm", ".vtmb", ".vtpd", ".vtpc"});
// Of these, those of a single step, of which a pattern makes a series.
constexpr std::size_t first_of_a_step = 9;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

bool comes_before(std::string_view a, std::string_view b) {
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
      continue;
    }
    const auto run = [](std::string_view text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t from = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      return text.substr(from, at - from);
    };
    const std::string_view left = run(a, i);
    const std::string_view right = run(b, j);
    if (left.size() != right.size()) return left.size() < right.size();
    if (left != right) return left < right;
  }
  if (i == a.size() && j == b.size()) return a < b;
  return i == a.size();
}

namespace {

// What the alternatives of the first list in braces have in common, or else the first of them: the
// folders and extensions of `{a/x_1.nc,b/x_2.nc}` apart, x.
std::string name_of_list(const std::string& pattern) {
  const std::size_t open = pattern.find('{');
  const std::size_t close = pattern.find('}', open);
  if (open == std::string::npos || close == std::string::npos) return {};
  std::vector<std::string> names;
  for (std::size_t at = open + 1; at <= close;) {
    const std::size_t end = std::min(pattern.find(',', at), close);
    names.push_back(fs::path(pattern.substr(at, end - at)).stem().native());
    at = end + 1;
  }
  std::string common = names.front();
  for (const std::string& name : names) {
    const auto [end, other] = std::mismatch(common.begin(), common.end(), name.begin(), name.end());
    common.erase(end, common.end());
  }
  return common.empty() ? names.front() : common;
}

}  // namespace

std::string stem_of_pattern(const std::string& pattern) {
  std::string stem = fs::path(pattern).stem().native();
  std::string out;
  for (std::size_t i = 0; i < stem.size(); ++i) {
    if (stem[i] == '[' || stem[i] == '{') {
      const std::size_t end = stem.find(stem[i] == '[' ? ']' : '}', i);
      i = end == std::string::npos ? stem.size() : end;
    } else if (stem[i] != '*' && stem[i] != '?') {
      out += stem[i];
    }
  }
  const auto trim = [&out] {
    constexpr const char* separators = "_-.";
    out.erase(0, std::min(out.find_first_not_of(separators), out.size()));
    out.erase(out.find_last_not_of(separators) + 1);
  };
  trim();
  if (out.empty()) out = name_of_list(pattern);
  std::erase_if(out, [](char c) { return c == '*' || c == '?' || c == '[' || c == ']'; });
  trim();
  return out.empty() ? "series" : out;
}

bool may_have_companions(const std::string& name) {
  const std::string ending = lower(fs::path(name).extension().native());
  return std::find(with_companions.begin(), with_companions.end(), ending) != with_companions.end();
}

bool steps_may_have_companions(const std::string& pattern) {
  const std::string ending = lower(fs::path(pattern).extension().native());
  return std::find(with_companions.begin() + first_of_a_step, with_companions.end(), ending) !=
         with_companions.end();
}

namespace {

Error not_reached(const std::string& path, const std::error_code& fault) {
  const bool absent =
      fault == std::errc::no_such_file_or_directory || fault == std::errc::not_a_directory;
  return make_error(absent ? ErrorKind::not_found : ErrorKind::bad_data,
                    in_quotes(path) + ": " + (absent ? "no such file" : fault.message()));
}

Result<Location> locate_series(const std::string& pattern) {
  const fs::path whole(pattern);
  const std::string name = whole.filename().native();
  const fs::path beside = whole.has_parent_path() ? whole.parent_path() : fs::path(".");
  std::error_code fault;
  const fs::path folder = fs::canonical(beside, fault);
  if (fault) return not_reached(beside.native(), fault);
  Location out;
  out.kind = Location::Kind::series;
  out.folder = folder.native();
  out.stem = stem_of_pattern(name);
  out.pattern = (folder / name).native();
  out.companions = steps_may_have_companions(name);
  const std::vector<std::string> alternatives = alternatives_of(name);
  for (fs::directory_iterator at(folder, fault), end; !fault && at != end; at.increment(fault)) {
    const std::string found = at->path().filename().native();
    if (alternative_matching(alternatives, found) < 0) continue;
    std::error_code broken;
    const fs::path path = fs::canonical(at->path(), broken);
    if (broken || !fs::is_regular_file(path, broken)) continue;
    out.members.push_back({found, path.native()});
    if (out.members.size() > series_members_max) {
      return make_error(ErrorKind::bad_data, in_quotes(pattern) + " matches more than " +
                                                 std::to_string(series_members_max) + " files");
    }
  }
  if (fault) return not_reached(folder.native(), fault);
  if (out.members.empty()) {
    return make_error(ErrorKind::not_found, in_quotes(pattern) + ": no file matches");
  }
  std::sort(out.members.begin(), out.members.end(),
            [](const auto& a, const auto& b) { return comes_before(a.name, b.name); });
  return out;
}

// "path?name=value", unless a file has this name. Errors as locate().
Result<Location> locate_selected(const std::string& path, std::size_t mark) {
  auto selection = parse_selection(std::string_view(path).substr(mark + 1));
  if (!selection) return selection.error();
  auto out = locate(path.substr(0, mark));
  if (!out) return out;
  if (!out->selection.empty()) {
    return make_error(ErrorKind::invalid, in_quotes(path) + " has two selections");
  }
  out->selection = std::move(*selection);
  return out;
}

// "path#/group", unless a file has this name. Errors as locate().
Result<Location> locate_inside(const std::string& path, std::size_t mark) {
  const std::string file = path.substr(0, mark);
  std::error_code fault;
  if (file.find("#/") != std::string::npos && !fs::exists(file, fault)) {
    return not_reached(path, std::make_error_code(std::errc::no_such_file_or_directory));
  }
  auto out = locate(file);
  if (!out) return out;
  if (out->kind == Location::Kind::folder) {
    return make_error(ErrorKind::bad_data,
                      in_quotes(path) + ": a folder has no groups to select by '#'");
  }
  out->inside = path.substr(mark + 2);
  return out;
}

}  // namespace

Result<Location> locate(const std::string& path_or_pattern) {
  const std::string& path = path_or_pattern;
  if (path.empty() || path.find('\0') != std::string::npos) {
    return make_error(ErrorKind::not_found, "no file name given");
  }
  if (looks_like_url(path)) return locate_url(path);
  std::error_code fault;
  const fs::path plain = fs::canonical(path, fault);
  if (fault) {
    if (const auto mark = selection_mark(path); mark != std::string::npos) {
      return locate_selected(path, mark);
    }
    if (const auto mark = path.rfind("#/"); mark != std::string::npos && mark > 0) {
      return locate_inside(path, mark);
    }
    const bool pattern = has_wildcard(fs::path(path).filename().native());
    return pattern ? locate_series(path) : Result<Location>(not_reached(path, fault));
  }
  Location out;
  // The path of a folder may end in a slash.
  const fs::path named =
      fs::path(path).has_filename() ? fs::path(path) : fs::path(path).parent_path();
  out.stem = named.stem().native();
  if (fs::is_directory(plain, fault)) {
    out.kind = Location::Kind::folder;
    out.folder = plain.native();
    return out;
  }
  out.folder = plain.parent_path().native();
  out.members.push_back({plain.filename().native(), plain.native()});
  out.companions = may_have_companions(plain.filename().native());
  return out;
}

std::string links_left_out(const Location& series) {
  if (series.kind != Location::Kind::series) return "";
  const std::vector<std::string> pattern =
      alternatives_of(fs::path(series.pattern).filename().native());
  std::set<std::string_view> members;
  for (const Location::Member& member : series.members) members.insert(member.name);
  std::size_t links = 0;
  std::error_code fault;
  for (fs::directory_iterator at(series.folder, fault), end; !fault && at != end;
       at.increment(fault)) {
    std::error_code unknown;
    if (!at->is_symlink(unknown)) continue;
    const std::string name = at->path().filename().native();
    const bool matches = alternative_matching(pattern, name) >= 0;
    links += matches && members.count(name) == 0 ? 1U : 0U;
  }
  if (links == 0) return "";
  return std::to_string(links) + " of " + std::to_string(links + members.size()) +
         " names that match the pattern " + (links == 1 ? "is" : "are") +
         " omitted: links that are dangling" +
         (series.root.empty() ? "" : " or lead out of the data root");
}

Result<Location> locate_again(const Location& series) {
  auto out = series.root.empty() ? locate_series(series.pattern)
                                 : locate_beneath(series.root, series.pattern);
  if (!out) return out;
  out->inside = series.inside;
  out->selection = series.selection;
  return out;
}

}  // namespace windsplat::data
