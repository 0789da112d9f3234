// Validates every member of a zarr.json of an array before memory is allocated for it.
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <numeric>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/formats/zarr/half.hpp"
#include "server/data/formats/zarr/metadata_parts.hpp"

namespace windsplat::data::zarr {

namespace {

constexpr std::size_t codecs_max = 16;
constexpr std::size_t shard_chunks_max = std::size_t{1} << 20;  // an index of 16 MiB
constexpr std::string_view numcodecs_prefix = "numcodecs.";

// The name of an extension: an object with a name, or just the name.
std::string name_of(const Json* json) {
  if (json == nullptr) return {};
  const Json* name = json->find("name");
  return name == nullptr ? json->text : name->text;
}

// The configuration of an extension; an empty object if it has none.
const Json& configuration_of(const Json& json) {
  static const Json none;
  const Json* found = json.find("configuration");
  return found == nullptr ? none : *found;
}

// Whether json[key] is one of two words; the first is the default. Empty: neither.
std::optional<bool> is_second(const Json& json, std::string_view key, std::string_view first,
                              std::string_view second) {
  const Json* found = json.find(key);
  if (found == nullptr || found->text == first) return false;
  return found->text == second ? std::optional(true) : std::nullopt;
}

std::optional<Dtype> dtype_named(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, Dtype>, 12> known{{{"bool", {'b', 1}},
                                                                      {"int8", {'i', 1}},
                                                                      {"int16", {'i', 2}},
                                                                      {"int32", {'i', 4}},
                                                                      {"int64", {'i', 8}},
                                                                      {"uint8", {'u', 1}},
                                                                      {"uint16", {'u', 2}},
                                                                      {"uint32", {'u', 4}},
                                                                      {"uint64", {'u', 8}},
                                                                      {"float16", {'f', 2}},
                                                                      {"float32", {'f', 4}},
                                                                      {"float64", {'f', 8}}}};
  const auto* at = std::find_if(known.begin(), known.end(),
                                [&](const auto& entry) { return entry.first == name; });
  return at == known.end() ? std::nullopt : std::optional(at->second);
}

std::string why_no_number(const std::string& name) {
  if (name.find("datetime") != std::string::npos || name.find("timedelta") != std::string::npos) {
    return "of the type " + in_quotes(name) + ": only times as numbers with units are supported";
  }
  return "of the type " + in_quotes(name) + ", which is not supported";
}

// The bits of a float in hexadecimal digits, most significant first.
std::optional<double> float_of_bits(std::string_view text, std::size_t bytes) {
  if (!text.starts_with("0x") || text.size() != 2 + 2 * bytes) return {};
  std::uint64_t bits = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data() + 2, end, bits, 16);
  if (status != std::errc() || stop != end) return {};
  if (bytes == 2) return static_cast<double>(Half{static_cast<std::uint16_t>(bits)});
  if (bytes == 4) return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
  return std::bit_cast<double>(bits);
}

Result<void> parse_fill_value(const Json& json, ArrayMetadata& out) {
  const Json* fill = json.find("fill_value");
  if (fill == nullptr) return broken_metadata("'fill_value' is missing");
  if (fill->kind == Json::Kind::null) return {};
  out.fill_value = as_number(*fill);
  if (!out.fill_value && out.dtype.kind == 'f') {
    out.fill_value = float_of_bits(fill->text, out.dtype.bytes);
  }
  if (!out.fill_value) return broken_metadata("'fill_value' is not a number");
  return {};
}

Result<void> parse_keys(const Json& json, ArrayMetadata& out) {
  const Json* encoding = json.find("chunk_key_encoding");
  const std::string name = name_of(encoding);
  if (name != "default" && name != "v2") {
    out.problem = "its chunk_key_encoding is " + in_quotes(name) + ", which is not supported";
    return {};
  }
  out.prefixed_keys = name == "default";
  const std::string separator = configuration_of(*encoding).text_at("separator");
  if (separator.empty()) {
    out.separator = out.prefixed_keys ? '/' : '.';
  } else if (separator == "." || separator == "/") {
    out.separator = separator[0];
  } else {
    return broken_metadata("the separator of 'chunk_key_encoding' is neither . nor /");
  }
  return {};
}

Result<void> parse_grid(const Json& json, ArrayMetadata& out) {
  auto shape = lengths(json, "shape", 0);
  if (!shape) return shape.error();
  out.shape = std::move(*shape);
  const Json* grid = json.find("chunk_grid");
  out.chunks.assign(out.shape.size(), 1);
  if (const std::string name = name_of(grid); name != "regular") {
    out.problem = "its chunk_grid is " + in_quotes(name) + ", which is not supported";
    return {};
  }
  auto chunks = lengths(configuration_of(*grid), "chunk_shape", 1);
  if (!chunks) return chunks.error();
  if (chunks->size() != out.shape.size()) {
    return broken_metadata("'shape' and 'chunk_shape' differ in rank");
  }
  out.chunks = std::move(*chunks);
  return check_chunks(out);
}

// The codecs of an array or of the chunks of its shards: first codecs of items (transpose, some of
// numcodecs), then `bytes` or `sharding_indexed`, then codecs of bytes.
class Pipeline {
 public:
  explicit Pipeline(ArrayMetadata& out) : out_(out), now_(out.dtype) {}

  Result<void> parse(const Json* codecs) {
    if (codecs == nullptr || codecs->kind != Json::Kind::list || codecs->list.size() > codecs_max) {
      return broken_metadata("'codecs' is not a list of at most " + std::to_string(codecs_max));
    }
    serialized_ = false;
    for (const Json& codec : codecs->list) {
      if (auto fine = parse_codec(codec); !fine) return fine;
      if (!out_.problem.empty()) return {};
    }
    if (!serialized_) return broken_metadata("'codecs' has neither bytes nor sharding_indexed");
    return {};
  }

 private:
  Result<void> parse_codec(const Json& codec) {
    const std::string name = name_of(&codec);
    const Json& configuration = configuration_of(codec);
    const bool of_items = name == "transpose" || name == "bytes" || name == "sharding_indexed";
    if (of_items && serialized_) return broken_metadata(in_quotes(name) + " follows bytes");
    if (name == "transpose") return parse_transpose(configuration);
    if (name == "sharding_indexed") return parse_sharding(configuration);
    if (name == "bytes") return parse_bytes(configuration);
    const bool ours = name.starts_with(numcodecs_prefix);
    const std::string id = ours ? name.substr(numcodecs_prefix.size()) : name;
    const auto compressor = compressor_named(id);
    const bool core = compressor && name != "zlib" && name != "lz4";
    if (!ours && !core && name != "crc32c") {
      if (unknown_member({.object = {{name, codec}}}, {}).empty()) return {};
      out_.problem = "encoded with the codec " + in_quotes(name) + ", which is not supported";
      return {};
    }
    const bool of_bytes = compressor || name == "crc32c" || id == "shuffle";
    if (of_bytes != serialized_) {
      return broken_metadata(in_quotes(name) + (of_bytes ? " precedes" : " follows") + " bytes");
    }
    if (whole_shard_ || (compressed_ && name != "crc32c")) {
      out_.problem = "encoded with " + in_quotes(name) + " after " +
                     (whole_shard_ ? "'sharding_indexed'" : "another compressor") +
                     ", which is not supported";
      return {};
    }
    compressed_ = compressed_ || compressor;
    if (name == "crc32c") {
      out_.codecs.emplace_back().kind = Codec::Kind::crc32c;
    } else {
      add_numcodec(id, configuration, now_, out_);
    }
    return {};
  }

  Result<void> parse_transpose(const Json& configuration) {
    const Json* order = configuration.find("order");
    std::vector<std::size_t> stored;  // the new dimensions among the previous ones
    const std::size_t rank = out_.order.size();
    std::vector<bool> seen(rank, false);
    for (const Json& entry : order == nullptr ? std::vector<Json>() : order->list) {
      const auto d = static_cast<std::size_t>(entry.integer);
      if (!entry.is_integer || entry.integer < 0 || d >= rank || seen[d]) break;
      seen[d] = true;
      stored.push_back(out_.order[d]);
    }
    if (stored.size() != rank || order == nullptr || order->list.size() != rank) {
      return broken_metadata("the order of 'transpose' is not a permutation of the dimensions");
    }
    out_.order = std::move(stored);
    return {};
  }

  Result<void> parse_bytes(const Json& configuration) {
    serialized_ = true;
    const auto big = is_second(configuration, "endian", "little", "big");
    if (!big) return broken_metadata("the endian of 'bytes' is neither little nor big");
    if (*big && now_.bytes > 1) {
      out_.codecs.push_back({.kind = Codec::Kind::swap_bytes, .element_bytes = now_.bytes});
    }
    return {};
  }

  Result<void> parse_sharding(const Json& configuration) {
    if (out_.shard || !out_.codecs.empty()) {
      out_.problem = out_.shard ? "sharded within shards, which is not supported"
                                : "encoded before 'sharding_indexed', which is not supported";
      return {};
    }
    auto inner = lengths(configuration, "chunk_shape", 1);
    if (!inner) return inner.error();
    Shard shard;
    shard.shape = out_.chunks;
    shard.order = out_.order;
    if (inner->size() != shard.shape.size()) {
      return broken_metadata("the chunk_shape of 'sharding_indexed' differs in rank");
    }
    std::size_t count = 1;
    for (std::size_t i = 0; i < inner->size(); ++i) {
      const std::size_t d = out_.order[i];
      if (shard.shape[d] % (*inner)[i] != 0) {
        return broken_metadata("a shard is not a whole number of its chunks");
      }
      out_.chunks[d] = (*inner)[i];
      const std::size_t along = shard.shape[d] / (*inner)[i];
      count = along > shard_chunks_max / count ? shard_chunks_max + 1 : count * along;
      if (count > shard_chunks_max) {
        return broken_metadata("its shards have more than " + std::to_string(shard_chunks_max) +
                               " chunks");
      }
    }
    if (auto fine = check_chunks(out_); !fine) return fine;
    const auto at_start = is_second(configuration, "index_location", "end", "start");
    if (!at_start) return broken_metadata("'index_location' is neither start nor end");
    shard.index_at_start = *at_start;
    if (auto fine = parse_index(configuration.find("index_codecs"), shard); !fine) return fine;
    out_.shard = std::move(shard);
    if (auto fine = parse(configuration.find("codecs")); !fine) return fine;
    whole_shard_ = true;
    return {};
  }

  // `bytes`, optionally followed by crc32c: other codecs have no fixed size or no use here.
  Result<void> parse_index(const Json* codecs, Shard& shard) {
    if (codecs == nullptr || codecs->list.empty()) {
      return broken_metadata("'index_codecs' is not a list of codecs");
    }
    shard.index_checked = codecs->list.size() > 1;
    for (std::size_t i = 0; i < codecs->list.size(); ++i) {
      const std::string name = name_of(&codecs->list[i]);
      if (i > 1 || name != (i == 0 ? "bytes" : "crc32c")) {
        out_.problem =
            "its shards have an index encoded with " + in_quotes(name) + ", which is not supported";
        return {};
      }
    }
    const auto big = is_second(configuration_of(codecs->list[0]), "endian", "little", "big");
    if (!big) return broken_metadata("the endian of 'index_codecs' is neither little nor big");
    shard.index_big_endian = *big;
    return {};
  }

  ArrayMetadata& out_;
  Dtype now_;                // of the items so far
  bool serialized_ = false;  // whether items have become bytes
  bool compressed_ = false;
  bool whole_shard_ = false;  // whether the codecs of a shard's chunks are complete
};

}  // namespace

Result<ArrayMetadata> parse_v3(const Json& json) {
  const Json* version = json.find("zarr_format");
  if (version == nullptr || !version->is_integer || version->integer != 3) {
    return broken_metadata("'zarr_format' is not 3");
  }
  ArrayMetadata out;
  if (auto fine = parse_grid(json, out); !fine) return fine.error();
  out.order.resize(out.shape.size());
  std::iota(out.order.begin(), out.order.end(), std::size_t{0});
  if (!out.problem.empty()) return out;
  const Json* type = json.find("data_type");
  if (type == nullptr) return broken_metadata("'data_type' is missing");
  const auto dtype = dtype_named(name_of(type));
  if (!dtype) {
    out.problem = why_no_number(name_of(type));
    return out;
  }
  out.dtype = *dtype;
  if (const std::string extension = unknown_member(
          json, {"zarr_format", "node_type", "shape", "data_type", "chunk_grid",
                 "chunk_key_encoding", "fill_value", "codecs", "attributes", "dimension_names",
                 "storage_transformers", "consolidated_metadata"});
      !extension.empty()) {
    out.problem = "it has the extension " + in_quotes(extension) + ", which is not supported";
    return out;
  }
  if (const Json* transformers = json.find("storage_transformers");
      transformers != nullptr && !transformers->list.empty()) {
    out.problem = "it has the storage transformer " + in_quotes(name_of(&transformers->list[0])) +
                  ", which is not supported";
    return out;
  }
  if (auto fine = parse_keys(json, out); !fine) return fine.error();
  if (auto fine = parse_fill_value(json, out); !fine) return fine.error();
  if (!out.problem.empty()) return out;
  if (auto fine = Pipeline(out).parse(json.find("codecs")); !fine) return fine.error();
  limit_chunk(out);
  return out;
}

}  // namespace windsplat::data::zarr
