// One XML file of VTK. The text before appended data -> pugixml; arrays -> their places in the
// file.
#include "server/data/formats/vtk/xml_document.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"

namespace windsplat::data::vtk {

namespace {

using pugi::xml_node;

constexpr std::uint64_t text_bytes_max = std::uint64_t{256} << 20;
constexpr std::size_t elements_max = 1'000'000;
constexpr std::size_t attributes_max = 4'000'000;
constexpr std::size_t block_bytes = std::size_t{4} << 20;
constexpr std::string_view appended_tag = "<AppendedData";

// Line ends are not normalised, so that offsets and lengths in memory equal those in the file.
constexpr unsigned parse_flags =
    pugi::parse_escapes | pugi::parse_wconv_attribute | pugi::parse_cdata;

Result<void> check_amount(const InputFile& file, const std::string& text) {
  const auto tags = std::count(text.begin(), text.end(), '<');
  const auto attributes = std::count(text.begin(), text.end(), '=');
  if (static_cast<std::size_t>(tags) > elements_max ||
      static_cast<std::size_t>(attributes) > attributes_max) {
    return file.fault("has more than 1000000 XML elements or 4000000 attributes");
  }
  return {};
}

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> out;
  std::size_t at = 0;
  while (at < text.size() && out.size() < 16) {
    while (at < text.size() && is_blank(text[at])) ++at;
    const std::size_t from = at;
    while (at < text.size() && !is_blank(text[at])) ++at;
    if (at > from) out.push_back(text.substr(from, at - from));
  }
  return out;
}

// Exactly N numbers, or nullopt.
template <class T, std::size_t N, class Parse>
bool parse_list(std::string_view text, std::array<T, N>& out, const Parse& parse) {
  const auto found = words(text);
  if (found.size() != N) return false;
  for (std::size_t i = 0; i < N; ++i) {
    const auto value = parse(found[i]);
    if (!value) return false;
    out[i] = *value;
  }
  return true;
}

std::optional<bytes::Scalar> xml_type(std::string_view name) {
  constexpr std::array<std::string_view, 10> names{"Int8",    "UInt8",  "Int16", "UInt16",
                                                   "Int32",   "UInt32", "Int64", "UInt64",
                                                   "Float32", "Float64"};
  const auto* at = std::find(names.begin(), names.end(), name);
  if (at == names.end()) return {};
  return static_cast<bytes::Scalar>(at - names.begin());
}

}  // namespace

// Reads the file up to its appended data. Errors: bad_data beyond the limit.
Result<Document::Text> Document::xml_part(const InputFile& file) {
  Text out;
  std::size_t searched = 0;
  while (out.text.size() < file.size()) {
    const std::size_t have = out.text.size();
    const auto part =
        static_cast<std::size_t>(std::min<std::uint64_t>(block_bytes, file.size() - have));
    if (have + part > text_bytes_max) {
      return file.fault("has more than 256 MiB of inline data; write it with appended data");
    }
    out.text.resize(have + part);
    if (auto done = file.read(have, out.text.data() + have, part); !done) return done.error();
    const std::size_t found = out.text.find(appended_tag, searched);
    if (found != std::string::npos) {
      out.text.resize(found);
      out.has_appended = true;
      return out;
    }
    searched = out.text.size() - std::min(out.text.size(), appended_tag.size() - 1);
  }
  return out;
}

Result<void> Document::load() {
  auto part = xml_part(*file_);
  if (!part) return part.error();
  text_ = std::move(*part);
  if (auto done = check_amount(*file_, text_.text); !done) return done;
  if (text_.has_appended) {
    if (auto done = find_appended(); !done) return done;
  }
  // The text before appended data lacks the end tag of the root.
  if (text_.has_appended) text_.text += "</VTKFile>";
  // Parsed in place, so that offsets are those of the file.
  const auto parsed = document_.load_buffer_inplace(text_.text.data(), text_.text.size(),
                                                    parse_flags, pugi::encoding_utf8);
  if (!parsed) {
    return file_->fault("is not well-formed XML: " + std::string(parsed.description()) +
                        " at byte " + std::to_string(parsed.offset));
  }
  root_ = document_.child("VTKFile");
  if (!root_) return file_->fault("has no VTKFile element");
  return find_coding();
}

bool extent_of(std::string_view text, Extent& out) {
  std::array<std::int64_t, 6> numbers{};
  if (!parse_list(text, numbers, bytes::to_integer)) return false;
  // Bounded so that differences do not overflow.
  constexpr std::int64_t index_max = std::int64_t{1} << 31;
  for (const std::int64_t number : numbers) {
    if (number < -index_max || number > index_max) return false;
  }
  for (std::size_t a = 0; a < 3; ++a) {
    out.first[a] = numbers.at(2 * a);
    out.last[a] = numbers.at(2 * a + 1);
  }
  return true;
}

// Finds the attributes of the tag, and the start of the data after the first '_'.
Result<void> Document::find_appended() {
  const std::uint64_t tag_at = text_.text.size();
  std::string tag(static_cast<std::size_t>(std::min<std::uint64_t>(512, file_->size() - tag_at)),
                  '\0');
  if (auto done = file_->read(tag_at, tag.data(), tag.size()); !done) return done;
  const std::size_t end = tag.find('>');
  const std::size_t mark = end == std::string::npos ? end : tag.find('_', end);
  if (mark == std::string::npos) return file_->fault("has appended data without a first '_'");
  appended_base64_ = tag.substr(0, end).find("base64") != std::string::npos;
  appended_at_ = tag_at + mark + 1;
  return {};
}

Result<void> Document::find_coding() {
  const std::string order = root_.attribute("byte_order").value();
  const std::string width = root_.attribute("header_type").as_string("UInt32");
  const std::string compressor = root_.attribute("compressor").value();
  if (order != "LittleEndian" && order != "BigEndian" && !order.empty()) {
    return file_->fault("has the byte order " + in_quotes(order));
  }
  if (width != "UInt32" && width != "UInt64") {
    return file_->fault("has headers of the type " + in_quotes(width));
  }
  coding_.big_endian = order == "BigEndian";
  coding_.header_bytes = width == "UInt64" ? 8 : 4;
  if (compressor == "vtkZLibDataCompressor") {
    coding_.compressor = Compressor::zlib;
  } else if (compressor == "vtkLZ4DataCompressor") {
    coding_.compressor = Compressor::lz4;
  } else if (!compressor.empty()) {
    return file_->fault("is compressed with " + in_quotes(compressor) +
                        "; supported: vtkZLibDataCompressor and vtkLZ4DataCompressor");
  }
  return {};
}

// Location of the values of an array; nullopt if unsupported, with a recorded reason.
Result<std::optional<StoredArray>> Document::array_of(const xml_node& node, std::uint64_t tuples,
                                                      Snapshot& out) const {
  StoredArray array;
  array.name = node.attribute("Name").as_string("unnamed");
  array.tuples = tuples;
  array.coding = coding_;
  const std::string type_name = node.attribute("type").value();
  const auto type = xml_type(type_name);
  if (!type) {
    out.left_out.push_back({array.name, "its type " + in_quotes(type_name) + " is not numeric"});
    return std::optional<StoredArray>();
  }
  array.type = *type;
  const auto components = bytes::to_integer(node.attribute("NumberOfComponents").as_string("1"));
  if (!components || *components < 1 || *components > 1024) {
    return file_->fault("is malformed: the array " + in_quotes(array.name) +
                        " has a number of components outside 1 to 1024");
  }
  array.components = static_cast<int>(*components);
  for (int c = 0; c < array.components && c < 3; ++c) {
    const std::string key = "ComponentName" + std::to_string(c);
    if (const auto name = node.attribute(key.c_str())) {
      array.component_names.emplace_back(name.value());
    }
  }
  if (array.component_names.size() != static_cast<std::size_t>(array.components)) {
    array.component_names.clear();
  }
  if (auto done = place(node, array); !done) return done.error();
  return std::optional(std::move(array));
}

Result<void> Document::place(const xml_node& node, StoredArray& array) const {
  const std::string format = node.attribute("format").as_string("ascii");
  if (format == "appended") {
    const auto offset = bytes::to_integer(node.attribute("offset").value());
    if (!text_.has_appended || !offset || *offset < 0 ||
        static_cast<std::uint64_t>(*offset) > file_->size() - appended_at_) {
      return file_->fault("is malformed: the array " + in_quotes(array.name) +
                          " lies outside the appended data");
    }
    array.encoding = appended_base64_ ? Encoding::base64 : Encoding::raw;
    array.offset = appended_at_ + static_cast<std::uint64_t>(*offset);
    array.room = file_->size() - array.offset;
    return {};
  }
  if (format != "ascii" && format != "binary") {
    return file_->fault("is malformed: the array " + in_quotes(array.name) + " has the format " +
                        in_quotes(format));
  }
  array.encoding = format == "ascii" ? Encoding::text : Encoding::base64;
  for (const xml_node child : node.children()) {
    if (child.type() != pugi::node_pcdata && child.type() != pugi::node_cdata) continue;
    if (child.offset_debug() < 0) continue;
    array.offset = static_cast<std::uint64_t>(child.offset_debug());
    array.room = std::strlen(child.value());
    break;
  }
  return {};
}

Result<void> Document::read_arrays(const xml_node& group, std::uint64_t tuples, Snapshot& out,
                                   std::vector<StoredArray>& arrays) const {
  for (const xml_node node : group.children()) {
    const std::string_view kind = node.name();
    if (kind != "DataArray" && kind != "Array") continue;
    auto array = array_of(node, tuples, out);
    if (!array) return array.error();
    if (*array) arrays.push_back(std::move(**array));
  }
  return {};
}

Result<void> Document::read_time(const xml_node& group, Snapshot& out) const {
  for (const xml_node node : group.children("DataArray")) {
    const std::string_view name = node.attribute("Name").value();
    if (name != "TimeValue" && name != "TIME") continue;
    auto array = array_of(node, 1, out);
    if (!array) return array.error();
    if (!*array || (*array)->components != 1) continue;
    const auto values = read_all(file_, **array);
    if (!values) return values.error();
    if (std::isfinite(values->front())) out.time = values->front();
  }
  return {};
}

Result<void> Document::read_placement(const xml_node& set, Placement& out) const {
  const auto list = [&](const char* name, auto& numbers) {
    const auto attribute = set.attribute(name);
    return !attribute || parse_list(attribute.value(), numbers, bytes::to_sample);
  };
  if (!list("Origin", out.origin) || !list("Spacing", out.spacing) ||
      !list("Direction", out.direction)) {
    return file_->fault("has an Origin, Spacing or Direction that is not a list of numbers");
  }
  return {};
}

bool is_xml(std::string_view head) {
  if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);
  head = trim(head);
  return head.starts_with('<') && head.find("<VTKFile") != std::string_view::npos;
}

}  // namespace windsplat::data::vtk
