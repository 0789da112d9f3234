// Bytes -> inflated -> without comments -> words.
#include "server/vtk_loader/foam_header.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

#include "server/base/ascii.hpp"

namespace windsplat::vtk_loader {

namespace {

constexpr std::size_t head_bytes = std::size_t{1} << 13;

std::string inflated(const std::string& packed) {
  std::string out(head_bytes, '\0');
  z_stream stream{};
  constexpr int gzip_only = 15 + 16;
  if (::inflateInit2(&stream, gzip_only) != Z_OK) return {};
  std::string in = packed;
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  static_cast<void>(::inflate(&stream, Z_SYNC_FLUSH));  // as much as the bytes given contain
  out.resize(stream.total_out);
  ::inflateEnd(&stream);
  return out;
}

std::string without_comments(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    if (text.starts_with("//")) {
      text.remove_prefix(std::min(text.find('\n'), text.size()));
    } else if (text.starts_with("/*")) {
      const auto end = text.find("*/", 2);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 2);
      out += ' ';
    } else {
      out += text.front();
      text.remove_prefix(1);
    }
  }
  return out;
}

// What follows a word that begins a statement, up to `end`; nullopt if there is none.
std::optional<std::string_view> after(std::string_view text, std::string_view word, char end) {
  for (std::size_t at = text.find(word); at != std::string_view::npos;
       at = text.find(word, at + 1)) {
    const bool begins = at == 0 || is_blank(text[at - 1]) || text[at - 1] == '{' ||
                        text[at - 1] == ';' || text[at - 1] == '}';
    const std::string_view rest = text.substr(at + word.size());
    if (!begins || rest.empty() || !(is_blank(rest.front()) || rest.front() == '[')) continue;
    const auto stop = rest.find(end);
    if (stop == std::string_view::npos) return {};
    return trim(rest.substr(0, stop));
  }
  return {};
}

std::string_view unquoted(std::string_view text) {
  const bool is_quoted = text.size() >= 2 && text.front() == '"' && text.back() == '"';
  return is_quoted ? text.substr(1, text.size() - 2) : text;
}

// The entry is a text with semicolons in it.
std::string_view arch_of(std::string_view header) {
  const auto begin = after(header, "arch", '"');  // up to the text: blanks only
  if (!begin || !begin->empty()) return {};
  const auto open = header.find('"', static_cast<std::size_t>(begin->data() - header.data()));
  const auto close = header.find('"', open + 1);
  return close == std::string_view::npos ? "" : header.substr(open + 1, close - open - 1);
}

// "[0 1 -1 0 0 0 0]" -> exponents of kg m s K mol A cd, of which the last two may be absent.
std::optional<std::vector<double>> exponents_of(std::string_view text) {
  constexpr std::size_t all = 7;
  constexpr std::size_t without_current = 5;
  if (!text.starts_with('[')) return {};
  text.remove_prefix(1);
  std::vector<double> out;
  for (text = trim(text); !text.empty(); text = trim(text)) {
    double value = 0;
    const auto [stop, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (fault != std::errc() || !std::isfinite(value) || out.size() == all) return {};
    out.push_back(value);
    text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
  }
  if (out.size() != all && out.size() != without_current) return {};
  out.resize(all, 0);
  return out;
}

std::string number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string units_of(const std::vector<double>& exponents) {
  constexpr std::array<const char*, 7> base{"kg", "m", "s", "K", "mol", "A", "cd"};
  if (exponents == std::vector<double>{1, -1, -2, 0, 0, 0, 0}) return "Pa";
  std::string out;
  for (std::size_t i = 0; i < base.size(); ++i) {
    if (exponents[i] == 0) continue;
    if (!out.empty()) out += ' ';
    out += base.at(i);
    const bool is_whole = exponents[i] == std::round(exponents[i]);
    if (exponents[i] != 1) out += (is_whole ? "" : "^") + number(exponents[i]);
  }
  return out.empty() ? "1" : out;
}

}  // namespace

std::optional<FoamHeader> parse_foam_header(std::string_view text) {
  const std::string plain = without_comments(text);
  const auto begin = plain.find("FoamFile");
  if (begin == std::string::npos) return {};
  const auto open = plain.find('{', begin);
  const auto close = plain.find('}', begin);
  if (open == std::string::npos || close == std::string::npos || close < open) return {};
  const std::string_view all = plain;
  const auto entry = [&](std::string_view word) {
    return after(all.substr(open, close - open), word, ';');
  };
  const auto name = entry("class");
  if (!name) return {};
  FoamHeader out;
  out.class_name = *name;
  out.object = unquoted(entry("object").value_or(""));
  out.is_binary = entry("format").value_or("") == "binary";
  out.arch = arch_of(all.substr(open, close - open));
  if (const auto set = after(all.substr(close), "dimensions", ']')) {
    if (const auto exponents = exponents_of(*set)) out.units = units_of(*exponents);
  }
  return out;
}

std::optional<std::string> unread_layout_of(const FoamHeader& header) {
  if (!header.is_binary || header.arch.empty()) return {};
  std::string_view rest = header.arch;
  bool is_known = true;
  while (!rest.empty()) {
    const auto end = std::min(rest.find(';'), rest.size());
    const std::string_view part = trim(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    is_known = is_known && (part.empty() || part == "LSB" || part == "label=32" ||
                            part == "label=64" || part == "scalar=32" || part == "scalar=64");
  }
  if (is_known) return {};
  return "has binary data of the layout " + in_quotes(header.arch) +
         ", which VTK does not read; write it as ascii (foamFormatConvert)";
}

Result<FoamHeader> foam_header_of(const data::InputFile& file) {
  auto head = file.head(head_bytes);
  if (!head) return head.error();
  const std::string text = head->starts_with("\x1f\x8b") ? inflated(*head) : std::move(*head);
  if (auto out = parse_foam_header(text)) return std::move(*out);
  return file.fault("has no header of OpenFOAM (FoamFile) with a class");
}

}  // namespace windsplat::vtk_loader
