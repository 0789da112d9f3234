// Validates every member of .zarray before memory is allocated for it.
#include <algorithm>
#include <numeric>
#include <string_view>
#include <utility>

#include "server/data/formats/zarr/dtype_v2.hpp"
#include "server/data/formats/zarr/metadata_parts.hpp"

namespace windsplat::data::zarr {

namespace {

constexpr std::size_t filters_max = 8;

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

void parse_filters(const Json* json, Dtype& now, ArrayMetadata& out) {
  if (json == nullptr || json->kind == Json::Kind::null) return;
  if (json->kind != Json::Kind::list || json->list.size() > filters_max) {
    out.problem = "its filters are not a list of at most " + std::to_string(filters_max);
    return;
  }
  for (const Json& entry : json->list) {
    const std::string id = entry.text_at("id");
    if (compressor_named(id)) {
      out.problem = "encoded with the filter " + in_quotes(id) + " in an unsupported way";
      return;
    }
    if (!add_numcodec(id, entry, now, out)) return;
  }
}

void parse_compressor(const Json* json, ArrayMetadata& out) {
  if (json == nullptr || json->kind == Json::Kind::null) return;
  const std::string id = json->text_at("id");
  const auto kind = compressor_named(id);
  if (!kind) {
    out.problem = "compressed with " + in_quotes(id) + ", which is not supported";
    return;
  }
  out.codecs.emplace_back().kind = *kind;
}

Result<void> parse_layout(const Json& json, ArrayMetadata& out) {
  auto shape = lengths(json, "shape", 0);
  if (!shape) return shape.error();
  auto chunks = lengths(json, "chunks", 1);
  if (!chunks) return chunks.error();
  if (shape->size() != chunks->size()) {
    return broken_metadata("'shape' and 'chunks' differ in rank");
  }
  out.shape = std::move(*shape);
  out.chunks = std::move(*chunks);
  if (auto fine = check_chunks(out); !fine) return fine;
  const Json* order = json.find("order");
  if (order == nullptr || (order->text != "C" && order->text != "F")) {
    return broken_metadata("'order' is neither C nor F");
  }
  out.order.resize(out.shape.size());
  std::iota(out.order.begin(), out.order.end(), std::size_t{0});
  if (order->text == "F") std::reverse(out.order.begin(), out.order.end());
  if (const Json* separator = json.find("dimension_separator")) {
    if (separator->text != "." && separator->text != "/") {
      return broken_metadata("'dimension_separator' is neither . nor /");
    }
    out.separator = separator->text[0];
  }
  return {};
}

}  // namespace

std::optional<StoredDtype> parse_dtype(const Json* json) {
  if (json == nullptr || json->kind != Json::Kind::text || json->text.size() != 3) return {};
  const std::string_view text = json->text;
  StoredDtype out;
  Dtype& type = out.type;
  type.kind = text[1];
  type.bytes = text[2] >= '0' && text[2] <= '9' ? static_cast<std::size_t>(text[2] - '0') : 0;
  out.big_endian = text[0] == '>';
  if (text[0] != '<' && text[0] != '>' && !(text[0] == '|' && type.bytes == 1)) return {};
  const bool whole = type.bytes == 1 || type.bytes == 2 || type.bytes == 4 || type.bytes == 8;
  const bool fits = type.kind == 'b'                       ? type.bytes == 1
                    : type.kind == 'i' || type.kind == 'u' ? whole
                    : type.kind == 'f'                     ? whole && type.bytes > 1
                                                           : false;
  return fits ? std::optional(out) : std::nullopt;
}

Result<ArrayMetadata> parse_v2(const Json& json) {
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
  out.dtype = dtype->type;
  if (dtype->big_endian && out.dtype.bytes > 1) {
    out.codecs.push_back({.kind = Codec::Kind::swap_bytes, .element_bytes = out.dtype.bytes});
  }
  Dtype now = out.dtype;
  parse_filters(json.find("filters"), now, out);
  if (out.problem.empty()) parse_compressor(json.find("compressor"), out);
  limit_chunk(out);
  if (const Json* fill = json.find("fill_value"); fill != nullptr) {
    out.fill_value = as_number(*fill);
    if (!out.fill_value && fill->kind != Json::Kind::null) {
      return broken_metadata("'fill_value' is not a number");
    }
  }
  return out;
}

}  // namespace windsplat::data::zarr
