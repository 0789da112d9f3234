#include "server/data/formats/zarr/metadata.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "server/data/bytes/decode_limits.hpp"
#include "server/data/formats/zarr/metadata_parts.hpp"

namespace windsplat::data::zarr {

namespace {

constexpr std::size_t rank_max = 8;
constexpr std::int64_t length_max = std::int64_t{1} << 40;
constexpr std::size_t items_max = std::size_t{1} << 48;
constexpr double chunks_max = 16777216;

double count_of(const std::vector<std::size_t>& shape, const std::vector<std::size_t>& chunks) {
  double count = 1;
  for (std::size_t d = 0; d < shape.size(); ++d) {
    count *= std::ceil(static_cast<double>(shape[d]) / static_cast<double>(chunks[d]));
  }
  return count;
}

}  // namespace

std::size_t ArrayMetadata::chunk_items() const {
  std::size_t items = 1;
  for (const std::size_t length : chunks) items *= length;
  return items;
}

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

Result<void> check_chunks(const ArrayMetadata& array) {
  if (count_of(array.shape, array.chunks) > chunks_max) {
    return broken_metadata("it has more than 16777216 chunks");
  }
  return {};
}

void limit_chunk(ArrayMetadata& array) {
  std::size_t widest = array.dtype.bytes;
  for (const Codec& codec : array.codecs) {
    if (codec.kind == Codec::Kind::fixed_scale_offset) {
      widest = std::max(widest, codec.encoded.bytes);
    }
  }
  if (array.chunk_items() > chunk_bytes_max / widest) {
    array.problem = "its chunks have more than " + std::to_string(chunk_bytes_max) + " bytes";
  }
}

std::optional<double> as_number(const Json& json) {
  if (json.kind == Json::Kind::number || json.kind == Json::Kind::boolean) return json.number;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (json.text == "NaN") return std::numeric_limits<double>::quiet_NaN();
  if (json.text == "Infinity") return infinity;
  if (json.text == "-Infinity") return -infinity;
  return {};
}

std::string unknown_member(const Json& json, const std::vector<std::string_view>& known) {
  for (const auto& [name, value] : json.object) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const Json* needed = value.find("must_understand");
    const bool optional =
        needed != nullptr && needed->kind == Json::Kind::boolean && needed->number == 0;
    if (!optional) return name;
  }
  return {};
}

}  // namespace windsplat::data::zarr
