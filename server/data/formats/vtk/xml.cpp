// XML files of VTK (.vti .vtr .vts .vtu .pvd). The text before appended data -> pugixml ->
// Snapshot; the locations of inline arrays are recorded for later reading.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <pugixml.hpp>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"
#include "server/data/formats/vtk/snapshot.hpp"

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

struct Text {
  std::string text;           // the XML part, without appended data
  bool has_appended = false;  // the tag of appended data begins at text.size()
};

// Reads the file up to its appended data. Errors: bad_data beyond the limit.
Result<Text> xml_part(const InputFile& file) {
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

// Parses one document; its text must outlive this object.
class Document {
 public:
  explicit Document(std::shared_ptr<const InputFile> file) : file_(std::move(file)) {}

  Result<void> load() {
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

  [[nodiscard]] xml_node root() const { return root_; }

  Result<Snapshot> snapshot() {
    Snapshot out;
    const std::string type = root_.attribute("type").value();
    if (type == "ImageData" || type == "UniformGrid") {
      out.kind = Kind::image;
      out.format = "VTK image data";
    } else if (type == "RectilinearGrid") {
      out.kind = Kind::rectilinear;
      out.format = "VTK rectilinear grid";
    } else if (type == "StructuredGrid") {
      out.kind = Kind::structured;
      out.format = "VTK structured grid";
    } else if (type == "UnstructuredGrid") {
      out.kind = Kind::unstructured;
      out.format = "VTK unstructured grid";
    } else {
      return file_->fault("holds VTK data of the type " + in_quotes(type) +
                          "; supported types: ImageData, RectilinearGrid, StructuredGrid, "
                          "UnstructuredGrid and Collection");
    }
    const xml_node set = root_.child(type.c_str());
    if (!set) return file_->fault("has no element " + in_quotes(type));
    if (out.kind != Kind::unstructured &&
        !extent_of(set.attribute("WholeExtent").value(), out.whole)) {
      return file_->fault("has no WholeExtent of six whole numbers within 2^31");
    }
    if (auto done = read_placement(set, out); !done) return done.error();
    for (const xml_node piece : set.children("Piece")) {
      if (auto done = read_piece(piece, out); !done) return done.error();
    }
    if (auto done = read_time(set.child("FieldData"), out); !done) return done.error();
    if (auto done = check_snapshot(file_, out); !done) return done.error();
    return out;
  }

 private:
  static bool extent_of(std::string_view text, Extent& out) {
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
  Result<void> find_appended() {
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

  Result<void> find_coding() {
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

  Result<void> read_placement(const xml_node& set, Snapshot& out) {
    if (out.kind != Kind::image) return {};
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

  // Location of the values of an array; nullopt if unsupported, with a recorded reason.
  Result<std::optional<StoredArray>> array_of(const xml_node& node, std::uint64_t tuples,
                                              Snapshot& out) {
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

  Result<void> place(const xml_node& node, StoredArray& array) const {
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

  Result<void> read_arrays(const xml_node& group, std::uint64_t tuples, Snapshot& out,
                           std::vector<StoredArray>& arrays) {
    for (const xml_node node : group.children()) {
      const std::string_view kind = node.name();
      if (kind != "DataArray" && kind != "Array") continue;
      auto array = array_of(node, tuples, out);
      if (!array) return array.error();
      if (*array) arrays.push_back(std::move(**array));
    }
    return {};
  }

  Result<void> read_piece(const xml_node& node, Snapshot& out) {
    Piece piece;
    piece.extent = out.whole;
    if (out.kind == Kind::unstructured) {
      const auto points = bytes::to_integer(node.attribute("NumberOfPoints").value());
      const auto cells = bytes::to_integer(node.attribute("NumberOfCells").value());
      if (!points || !cells || *points < 0 || *cells < 0) {
        return file_->fault("has a piece without valid numbers of points and cells");
      }
      piece.points = static_cast<std::uint64_t>(*points);
      piece.cells = static_cast<std::uint64_t>(*cells);
    } else if (const auto extent = node.attribute("Extent");
               extent && !extent_of(extent.value(), piece.extent)) {
      return file_->fault("has a piece whose Extent is not six whole numbers within 2^31");
    }
    const auto points =
        out.kind == Kind::unstructured ? piece.points : size_of(piece.extent.points());
    const auto cells = out.kind == Kind::unstructured ? piece.cells : size_of(piece.extent.cells());
    if (auto done = read_arrays(node.child("PointData"), points, out, piece.point_data); !done) {
      return done;
    }
    if (auto done = read_arrays(node.child("CellData"), cells, out, piece.cell_data); !done) {
      return done;
    }
    if (auto done = read_arrays(node.child("Points"), points, out, piece.coordinates); !done) {
      return done;
    }
    if (auto done = read_axes(node.child("Coordinates"), out, piece); !done) return done;
    if (auto done = read_cells(node.child("Cells"), out, piece); !done) return done;
    // Parallel writers emit an empty piece for a process without cells.
    if (points > 0) out.pieces.push_back(std::move(piece));
    return {};
  }

  // Invalid extents yield a wrong number here and are rejected by check_snapshot().
  static std::uint64_t size_of(const std::array<std::int64_t, 3>& counts) {
    std::uint64_t all = 1;
    for (const std::int64_t count : counts) all *= static_cast<std::uint64_t>(count);
    return all;
  }

  Result<void> read_axes(const xml_node& group, Snapshot& out, Piece& piece) {
    if (out.kind != Kind::rectilinear) return {};
    if (auto done = read_arrays(group, 0, out, piece.coordinates); !done) return done;
    const auto counts = piece.extent.points();
    for (std::size_t a = 0; a < std::min<std::size_t>(3, piece.coordinates.size()); ++a) {
      piece.coordinates[a].tuples = static_cast<std::uint64_t>(counts.at(a));
    }
    return {};
  }

  Result<void> read_cells(const xml_node& group, Snapshot& out, Piece& piece) {
    if (out.kind != Kind::unstructured) return {};
    std::vector<StoredArray> arrays;
    if (auto done = read_arrays(group, piece.cells, out, arrays); !done) return done;
    for (StoredArray& array : arrays) {
      if (array.components != 1)
        return file_->fault("has cells whose arrays have several components");
      if (array.name == "connectivity")
        piece.connectivity = std::move(array);
      else if (array.name == "offsets")
        piece.offsets = std::move(array);
      else if (array.name == "types")
        piece.types = std::move(array);
    }
    return {};
  }

  Result<void> read_time(const xml_node& group, Snapshot& out) {
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

  std::shared_ptr<const InputFile> file_;
  Text text_;
  pugi::xml_document document_;
  xml_node root_;
  Coding coding_;
  bool appended_base64_ = false;
  std::uint64_t appended_at_ = 0;
};

}  // namespace

bool is_xml(std::string_view head) {
  if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);
  head = trim(head);
  return head.starts_with('<') && head.find("<VTKFile") != std::string_view::npos;
}

Result<Snapshot> read_xml(const std::shared_ptr<const InputFile>& file) {
  Document document(file);
  if (auto done = document.load(); !done) return done.error();
  return document.snapshot();
}

Result<std::optional<Collection>> read_collection(const std::shared_ptr<const InputFile>& file) {
  Document document(file);
  if (auto done = document.load(); !done) return done.error();
  if (std::string_view(document.root().attribute("type").value()) != "Collection") {
    return std::optional<Collection>();
  }
  Collection out;
  for (const xml_node node : document.root().child("Collection").children("DataSet")) {
    const std::string name = node.attribute("file").value();
    const auto text = node.attribute("timestep");
    const auto time = text ? bytes::to_sample(trim(text.value()))
                           : std::optional(static_cast<double>(out.members.size()));
    if (name.empty() || !time || !std::isfinite(*time)) {
      return file->fault("has a DataSet without a file, or with a timestep that is not a number");
    }
    out.members.push_back({*time, name});
  }
  if (out.members.empty()) return file->fault("is a collection without a DataSet");
  std::stable_sort(out.members.begin(), out.members.end(),
                   [](const auto& a, const auto& b) { return a.time < b.time; });
  for (std::size_t i = 1; i < out.members.size(); ++i) {
    if (out.members[i].time == out.members[i - 1].time) {
      return file->fault("has a timestep of several parts (" + in_quotes(out.members[i].file) +
                         "); only one file per timestep is supported");
    }
  }
  return std::optional(std::move(out));
}

}  // namespace windsplat::data::vtk
