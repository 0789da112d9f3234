// Codecs of numcodecs: those of version 2, and of version 3 under names that begin with
// "numcodecs.".
#include <limits>
#include <string_view>
#include <utility>

#include "server/data/formats/zarr/dtype_v2.hpp"
#include "server/data/formats/zarr/metadata_parts.hpp"

namespace windsplat::data::zarr {

namespace {

// Filters that only round on encoding need no decoding.
bool is_undone_already(const std::string& id, const Json& json) {
  const Json* decoded = json.find("dtype");
  const Json* encoded = json.find("astype");
  return id == "bitround" || (id == "quantize" && decoded != nullptr &&
                              (encoded == nullptr || encoded->text == decoded->text));
}

// Whether the filter is supported and its input has the type of the items so far.
bool parse_filter(const std::string& id, const Json& json, const Dtype& now, Codec& out) {
  if (id == "shuffle") {
    const Json* size = json.find("elementsize");
    out.kind = Codec::Kind::shuffle;
    out.element_bytes =
        size == nullptr || !size->is_integer || size->integer < 1 || size->integer > 256
            ? 0
            : static_cast<std::size_t>(size->integer);
    return out.element_bytes > 0;
  }
  const auto decoded = parse_dtype(json.find("dtype"));
  const auto encoded = json.find("astype") == nullptr ? decoded : parse_dtype(json.find("astype"));
  if (!decoded || !encoded || decoded->big_endian || encoded->big_endian) return false;
  out.decoded = decoded->type;
  out.encoded = encoded->type;
  if (out.decoded != now || (out.encoded.kind == 'f' && out.encoded.bytes < 4)) return false;
  if (id == "delta") {
    out.kind = Codec::Kind::delta;
    return out.decoded == out.encoded && out.decoded.kind != 'b';
  }
  if (id == "fixedscaleoffset" && out.decoded.kind == 'f' && out.decoded.bytes >= 4) {
    const Json* scale = json.find("scale");
    const Json* offset = json.find("offset");
    if (scale == nullptr || offset == nullptr) return false;
    out.kind = Codec::Kind::fixed_scale_offset;
    out.scale = as_number(*scale).value_or(0);
    out.offset = as_number(*offset).value_or(std::numeric_limits<double>::quiet_NaN());
    return out.scale != 0 && out.offset == out.offset;
  }
  return false;
}

}  // namespace

std::optional<Codec::Kind> compressor_named(std::string_view name) {
  for (const auto& [known, kind] : {std::pair{"zlib", Codec::Kind::zlib},
                                    {"gzip", Codec::Kind::gzip},
                                    {"zstd", Codec::Kind::zstd},
                                    {"lz4", Codec::Kind::lz4},
                                    {"blosc", Codec::Kind::blosc}}) {
    if (name == known) return kind;
  }
  return {};
}

bool is_compressor(Codec::Kind kind) {
  return kind >= Codec::Kind::zlib && kind <= Codec::Kind::blosc;
}

bool add_numcodec(const std::string& id, const Json& configuration, Dtype& now,
                  ArrayMetadata& array) {
  if (is_undone_already(id, configuration)) return true;
  Codec codec;
  if (const auto kind = compressor_named(id)) {
    codec.kind = *kind;
  } else if (!parse_filter(id, configuration, now, codec)) {
    array.problem = "encoded with the filter " + in_quotes(id) + " in an unsupported way";
    return false;
  }
  if (codec.kind == Codec::Kind::fixed_scale_offset) now = codec.encoded;
  array.codecs.push_back(codec);
  return true;
}

}  // namespace windsplat::data::zarr
