#include "server/data/formats/zarr/look_ahead.hpp"

#include "server/data/formats/zarr/codec.hpp"
#include "server/data/formats/zarr/shard.hpp"
#include "server/data/formats/zarr/store.hpp"

namespace windsplat::data::zarr {

void Store::look_ahead(const Array& array, Outlook& outlook) const {
  const ArrayMetadata& metadata = array.metadata;
  const bool are_many = outlook.files.first != outlook.files.last;
  for (; are_many && !outlook.named.is_over && outlook.named.count < outlook.read + Outlook::names;
       outlook.named.step(outlook.files)) {
    const std::uint64_t number = number_of_file(metadata, outlook.named.at);
    if (outlook.named.count == outlook.read || shards_.has(number)) continue;
    files_->expect({.name = array.path + file_key(metadata, number),
                    .in_parts = metadata.shard.has_value(),
                    .tail_bytes = metadata.shard ? index_bytes(metadata) : 0});
  }
  for (; metadata.shard && !outlook.told.is_over &&
         outlook.told.count < outlook.read + Outlook::shards;
       outlook.told.step(outlook.files)) {
    expect_chunks(array, number_of_file(metadata, outlook.told.at),
                  chunks_in(metadata, outlook.told.at, outlook.chunks));
  }
  ++outlook.read;
}

// Of a shard, whose faults are found when it is read.
void Store::expect_chunks(const Array& array, std::uint64_t number,
                          const ChunkRange& chunks) const {
  const auto shard = shard_at(array, number);
  if (!shard || !(*shard)->file.input || (*shard)->file.input->parts().number == 0) return;
  Expected what{.name = (*shard)->file.path, .in_parts = true};
  std::vector<std::size_t> place = chunks.first;
  do {
    const ChunkPlace at = place_of(array.metadata, place);
    if (kept_.has(at.number()) || (*shard)->is_absent(at.in_file)) continue;
    const Span& span = (*shard)->index.at(at.in_file);
    if (span.bytes > stored_bytes_max(array.metadata)) continue;
    what.extents.push_back({span.offset, span.offset + span.bytes});
  } while (advance(place, chunks, place.size()));
  if (!what.extents.empty()) files_->expect(what);
}

}  // namespace windsplat::data::zarr
