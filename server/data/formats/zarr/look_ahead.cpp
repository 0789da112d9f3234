#include "server/data/formats/zarr/look_ahead.hpp"

#include <algorithm>
#include <utility>

#include "server/data/formats/zarr/codec.hpp"
#include "server/data/formats/zarr/shard.hpp"
#include "server/data/formats/zarr/store.hpp"

namespace windsplat::data::zarr {

void Store::expect(const std::vector<cf::Block>& blocks) const {
  if (!files_->location().fetched) return;
  const std::lock_guard lock(mutex_);
  expected_.clear();
  std::uint64_t named = 0;
  std::uint64_t told = 0;
  std::size_t bytes = 0;  // of indices
  // Calls `use` with the files of all blocks until it returns false.
  const auto for_files = [&](const auto& use) {
    for (const cf::Block& block : blocks) {
      const Array& array = array_of(block.variable);
      if (array.line || std::find(block.count.begin(), block.count.end(), 0) != block.count.end()) {
        continue;
      }
      const ChunkRange files = range_of(array.metadata.file_shape(), block.start, block.count);
      std::vector<std::size_t> file = files.first;
      do {
        if (!use(block, array, file)) return;
      } while (advance(file, files, file.size()));
    }
  };
  for_files([&](const cf::Block& block, const Array& array, const auto& file) {
    shards_.forget(block.variable);
    expect_file(array, number_of_file(array.metadata, file));
    return ++named < Outlook::names;
  });
  for_files([&](const cf::Block& block, const Array& array, const auto& file) {
    const ArrayMetadata& metadata = array.metadata;
    if (!metadata.shard) return true;
    bytes += index_bytes(metadata);
    if (bytes > Outlook::index_bytes_max) return false;
    const std::uint64_t number = number_of_file(metadata, file);
    auto shard = open_shard(array, number);
    if (!shard) return false;  // found again by the reader
    const ChunkRange all = range_of(metadata.chunks, block.start, block.count);
    expect_chunks(array, *shard, chunks_in(metadata, file, all));
    shard->is_told = true;
    expected_.insert_or_assign({block.variable, number}, std::move(*shard));
    return ++told < Outlook::shards;
  });
}

void Store::expect_file(const Array& array, std::uint64_t number) const {
  const ArrayMetadata& metadata = array.metadata;
  files_->expect({.name = array.path + file_key(metadata, number),
                  .in_parts = metadata.shard.has_value(),
                  .tail_bytes = metadata.shard ? index_bytes(metadata) : 0});
}

void Store::look_ahead(const Array& array, Outlook& outlook) const {
  const ArrayMetadata& metadata = array.metadata;
  const int variable = variable_of(array);
  const bool are_many = outlook.files.first != outlook.files.last;
  for (; are_many && !outlook.named.is_over && outlook.named.count < outlook.read + Outlook::names;
       outlook.named.step(outlook.files)) {
    const std::uint64_t number = number_of_file(metadata, outlook.named.at);
    const bool is_known = shards_.has(variable, number) || expected_.contains({variable, number});
    if (outlook.named.count != outlook.read && !is_known) expect_file(array, number);
  }
  for (; metadata.shard && !outlook.told.is_over &&
         outlook.told.count < outlook.read + Outlook::shards;
       outlook.told.step(outlook.files)) {
    const auto shard = shard_at(array, number_of_file(metadata, outlook.told.at));
    if (!shard || (*shard)->is_told) continue;
    expect_chunks(array, **shard, chunks_in(metadata, outlook.told.at, outlook.chunks));
  }
  ++outlook.read;
}

// Of a file in parts; what its host sent as a whole is there.
void Store::expect_chunks(const Array& array, const OpenShard& shard,
                          const ChunkRange& chunks) const {
  if (!shard.file.input || shard.file.input->parts().number == 0) return;
  Expected what{.name = shard.file.path, .in_parts = true};
  std::vector<std::size_t> place = chunks.first;
  do {
    const ChunkPlace at = place_of(array.metadata, place);
    if (kept_.has(variable_of(array), at.number()) || shard.is_absent(at.in_file)) continue;
    const Span& span = shard.index.at(at.in_file);
    if (span.bytes > stored_bytes_max(array.metadata)) continue;
    what.extents.push_back({span.offset, span.offset + span.bytes});
  } while (advance(place, chunks, place.size()));
  if (!what.extents.empty()) files_->expect(what);
}

}  // namespace windsplat::data::zarr
