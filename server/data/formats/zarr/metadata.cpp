// Validates every member of .zarray before memory is allocated for it.
#include "server/data/formats/zarr/metadata.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "server/data/bytes/decode_limits.hpp"

namespace windsplat::data::zarr {

namespace {

constexpr std::size_t rank_max = 8;
constexpr std::int64_t length_max = std::int64_t{1} << 40;
constexpr std::size_t items_max = std::size_t{1} << 48;
constexpr std::size_t filters_max = 8;
constexpr double chunks_max = 16777216;

Error broken_metadata(const std::string& what) { return make_error(ErrorKind::bad_data, what); }

Result<std::vector<std::size_t>> lengths(const Json& json, const char* key, std::int64_t least) {
  const Json* found = json.find(key);
  const std::string name = in_quotes(key);
  if (found == nullptr || found->kind != Json::Kind::list || found->list.size() > rank_max) {
    return broken_metadata(name + " is not a list of at most " + std::to_string(rank_max) +
                           " lengths");
  }
  std::vector<std::size_t> out;
  std::size_t product = 1;
  for (const Json& entry : found->list) {
    if (!entry.is_integer || entry.integer < least || entry.integer > length_max) {
      return broken_metadata(name + " has a length that is not between " + std::to_string(least) +
                             " and " + std::to_string(length_max));
    }
    out.push_back(static_cast<std::size_t>(entry.integer));
    if (out.back() != 0 && product > items_max / out.back()) {
      return broken_metadata(name + " has more than " + std::to_string(items_max) + " items");
    }
    product *= out.back();
  }
  return out;
}

// nullopt for types other than plain numbers.
std::optional<Dtype> parse_dtype(const Json* json) {
  if (json == nullptr || json->kind != Json::Kind::text || json->text.size() != 3) return {};
  const std::string_view text = json->text;
  Dtype out;
  out.kind = text[1];
  out.bytes = text[2] >= '0' && text[2] <= '9' ? static_cast<std::size_t>(text[2] - '0') : 0;
  out.big_endian = text[0] == '>';
  if (text[0] != '<' && text[0] != '>' && !(text[0] == '|' && out.bytes == 1)) return {};
  const bool whole = out.bytes == 1 || out.bytes == 2 || out.bytes == 4 || out.bytes == 8;
  const bool fits = out.kind == 'b'                      ? out.bytes == 1
                    : out.kind == 'i' || out.kind == 'u' ? whole
                    : out.kind == 'f'                    ? whole && out.bytes > 1
                                                         : false;
  return fits ? std::optional(out) : std::nullopt;
}

// An unsupported data type, reported by name.
std::string why_no_number(const Json* json) {
  if (json == nullptr || json->kind != Json::Kind::text) return "of a structured type";
  const std::string& text = json->text;
  const char kind = text.size() > 1 ? text[1] : ' ';
  if (kind == 'S' || kind == 'U' || kind == 'O') return "text or objects, not numbers";
  if (kind == 'M' || kind == 'm') {
    return "of the type " + in_quotes(text) + ": only times as numbers with units are supported";
  }
  return "of the type " + in_quotes(text) + ", which is not supported";
}

std::string id_of(const Json& json) {
  const Json* id = json.find("id");
  return id == nullptr ? "" : id->text;
}

void parse_compressor(const Json* json, ArrayMetadata& out) {
  if (json == nullptr || json->kind == Json::Kind::null) return;
  const std::string id = id_of(*json);
  const std::pair<std::string_view, Compressor> known[] = {{"zlib", Compressor::zlib},
                                                           {"gzip", Compressor::gzip},
                                                           {"zstd", Compressor::zstd},
                                                           {"lz4", Compressor::lz4},
                                                           {"blosc", Compressor::blosc}};
  for (const auto& [name, compressor] : known) {
    if (name == id) {
      out.compressor = compressor;
      return;
    }
  }
  out.problem = "compressed with " + in_quotes(id) + ", which is not supported";
}

bool same(const Dtype& a, const Dtype& b) {
  return a.kind == b.kind && a.bytes == b.bytes && a.big_endian == b.big_endian;
}

// Filters that only round on encoding need no decoding.
bool is_undone_already(const Json& json) {
  const std::string id = id_of(json);
  const Json* decoded = json.find("dtype");
  const Json* encoded = json.find("astype");
  return id == "bitround" || (id == "quantize" && decoded != nullptr &&
                              (encoded == nullptr || encoded->text == decoded->text));
}

// Whether the filter is supported; if so it is added to `out`.
bool parse_filter(const Json& json, Filter& out) {
  const std::string id = id_of(json);
  if (id == "shuffle") {
    const Json* size = json.find("elementsize");
    out.kind = Filter::Kind::shuffle;
    out.element_bytes =
        size == nullptr || !size->is_integer || size->integer < 1 || size->integer > 256
            ? 0
            : static_cast<std::size_t>(size->integer);
    return out.element_bytes > 0;
  }
  const auto decoded = parse_dtype(json.find("dtype"));
  const auto encoded = json.find("astype") == nullptr ? decoded : parse_dtype(json.find("astype"));
  if (!decoded || !encoded || decoded->big_endian || encoded->big_endian) return false;
  if (encoded->kind == 'f' && encoded->bytes < 4) return false;
  out.decoded = *decoded;
  out.encoded = *encoded;
  if (id == "delta") {
    out.kind = Filter::Kind::delta;
    return same(*decoded, *encoded) && decoded->kind != 'b';
  }
  if (id == "fixedscaleoffset" && decoded->kind == 'f' && decoded->bytes >= 4) {
    const Json* scale = json.find("scale");
    const Json* offset = json.find("offset");
    if (scale == nullptr || offset == nullptr) return false;
    out.kind = Filter::Kind::fixed_scale_offset;
    out.scale = as_number(*scale).value_or(0);
    out.offset = as_number(*offset).value_or(std::numeric_limits<double>::quiet_NaN());
    return out.scale != 0 && out.offset == out.offset;
  }
  return false;
}

void parse_filters(const Json* json, ArrayMetadata& out) {
  if (json == nullptr || json->kind == Json::Kind::null) return;
  if (json->kind != Json::Kind::list || json->list.size() > filters_max) {
    out.problem = "its filters are not a list of at most " + std::to_string(filters_max);
    return;
  }
  Dtype now = out.dtype;
  for (const Json& entry : json->list) {
    if (is_undone_already(entry)) continue;
    Filter filter;
    const bool typed = parse_filter(entry, filter);
    // The output type of a filter must be the input type of the next.
    if (!typed || (filter.kind != Filter::Kind::shuffle && !same(filter.decoded, now))) {
      out.problem = "encoded with the filter " + in_quotes(id_of(entry)) + " in an unsupported way";
      return;
    }
    if (filter.kind != Filter::Kind::shuffle) now = filter.encoded;
    out.filters.push_back(filter);
  }
}

Result<void> parse_layout(const Json& json, ArrayMetadata& out) {
  auto shape = lengths(json, "shape", 0);
  if (!shape) return shape.error();
  auto chunks = lengths(json, "chunks", 1);
  if (!chunks) return chunks.error();
  if (shape->size() != chunks->size())
    return broken_metadata("'shape' and 'chunks' differ in rank");
  out.shape = std::move(*shape);
  out.chunks = std::move(*chunks);
  double count = 1;
  for (std::size_t d = 0; d < out.shape.size(); ++d) {
    count *= std::ceil(static_cast<double>(out.shape[d]) / static_cast<double>(out.chunks[d]));
  }
  if (count > chunks_max) return broken_metadata("it has more than 16777216 chunks");
  const Json* order = json.find("order");
  if (order == nullptr || (order->text != "C" && order->text != "F")) {
    return broken_metadata("'order' is neither C nor F");
  }
  out.column_major = order->text == "F";
  if (const Json* separator = json.find("dimension_separator")) {
    if (separator->text != "." && separator->text != "/") {
      return broken_metadata("'dimension_separator' is neither . nor /");
    }
    out.separator = separator->text[0];
  }
  return {};
}

}  // namespace

std::size_t ArrayMetadata::chunk_items() const {
  std::size_t items = 1;
  for (const std::size_t length : chunks) items *= length;
  return items;
}

std::optional<double> as_number(const Json& json) {
  if (json.kind == Json::Kind::number || json.kind == Json::Kind::boolean) return json.number;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (json.text == "NaN") return std::numeric_limits<double>::quiet_NaN();
  if (json.text == "Infinity") return infinity;
  if (json.text == "-Infinity") return -infinity;
  return {};
}

Result<ArrayMetadata> parse_array(const Json& json) {
  const Json* version = json.find("zarr_format");
  if (version == nullptr || !version->is_integer || version->integer != 2) {
    return broken_metadata("'zarr_format' is not 2");
  }
  ArrayMetadata out;
  if (auto fine = parse_layout(json, out); !fine) return fine.error();
  const Json* type = json.find("dtype");
  if (type == nullptr) return broken_metadata("'dtype' is missing");
  const auto dtype = parse_dtype(type);
  if (!dtype) {
    out.problem = why_no_number(type);
    return out;
  }
  out.dtype = *dtype;
  parse_compressor(json.find("compressor"), out);
  if (out.problem.empty()) parse_filters(json.find("filters"), out);
  std::size_t widest = out.dtype.bytes;
  for (const Filter& filter : out.filters) widest = std::max(widest, filter.encoded.bytes);
  if (out.chunk_items() > chunk_bytes_max / widest) {
    out.problem = "its chunks have more than " + std::to_string(chunk_bytes_max) + " bytes";
  }
  if (const Json* fill = json.find("fill_value"); fill != nullptr) {
    out.fill_value = as_number(*fill);
    if (!out.fill_value && fill->kind != Json::Kind::null) {
      return broken_metadata("'fill_value' is not a number");
    }
  }
  return out;
}

}  // namespace windsplat::data::zarr
