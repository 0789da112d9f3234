#include "server/data/formats/zarr/chunk_cache.hpp"

#include <utility>

namespace windsplat::data::zarr {

void ChunkCache::select(int variable) {
  if (variable != variable_) clear();
  variable_ = variable;
}

void ChunkCache::forget(int variable) {
  if (variable == variable_) clear();
}

void ChunkCache::clear() {
  by_number_.clear();
  chunks_.clear();
  bytes_ = 0;
}

const ChunkBytes* ChunkCache::find(std::uint64_t number) {
  const auto at = by_number_.find(number);
  if (at == by_number_.end()) return nullptr;
  chunks_.splice(chunks_.begin(), chunks_, at->second);
  return &chunks_.front().bytes;
}

void ChunkCache::evict_for(std::size_t bytes, std::size_t bytes_max) {
  while (!chunks_.empty() && bytes_ + bytes > bytes_max) {
    bytes_ -= chunks_.back().bytes.size() + bookkeeping_bytes;
    by_number_.erase(chunks_.back().number);
    chunks_.pop_back();
  }
}

const ChunkBytes* ChunkCache::add(std::uint64_t number, ChunkBytes bytes) {
  bytes_ += bytes.size() + bookkeeping_bytes;
  chunks_.push_front({number, std::move(bytes)});
  by_number_.emplace(number, chunks_.begin());
  return &chunks_.front().bytes;
}

}  // namespace windsplat::data::zarr
