// Description of a dataset -> bytes that it and its fields take.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "server/data/model/box.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/stored.hpp"

namespace windsplat::data {

// Bytes of the dataset description that grow with the file.
inline std::uint64_t bytes_of(const DatasetInfo& info) {
  std::uint64_t bytes = 0;
  for (const Axis& axis : info.grid.axes) bytes += axis.coordinates.size() * sizeof(double);
  if (const auto& columns = info.grid.columns) {
    bytes += (columns->longitude.size() + columns->latitude.size()) * sizeof(double);
  }
  if (info.grid.ground) bytes += info.grid.ground->heights.size() * sizeof(float);
  for (const TimeStep& step : info.steps) bytes += sizeof step + step.text.capacity();
  if (info.stored) {
    for (const StoredField& of : info.stored->fields)
      bytes += of.ranges.size() * sizeof(StoredRange);
  }
  return bytes;
}

inline std::uint64_t values_of(const DatasetInfo& info, std::size_t field) {
  return info.grid.samples() * info.fields[field].components.size();
}

inline std::uint64_t bytes_of_box(const FieldInfo& field, const Box& box) {
  return box.samples() * field.components.size() * sizeof(float);
}

// Fields without duplicates.
inline std::uint64_t bytes_at_a_step(const DatasetInfo& info,
                                     const std::vector<std::string>& fields) {
  std::set<std::string> counted;
  std::uint64_t bytes = 0;
  for (const std::string& name : fields) {
    const FieldInfo* const field = info.find(name);
    if (field == nullptr || !counted.insert(name).second) continue;
    bytes += info.grid.samples() * field->components.size() * sizeof(float);
  }
  return bytes;
}

// Measured upper bound on the memory of a loader, in addition to the volumes, while it reads
// these fields. Chunks that are needed again are cached, up to 128 MiB or one chunk.
inline std::uint64_t reading_bytes(const DatasetInfo& info,
                                   const std::vector<std::string>& fields) {
  constexpr std::uint64_t mib = std::uint64_t{1} << 20;
  std::uint64_t bytes = 32 * mib;
  for (const std::string& name : fields) {
    const FieldInfo* const field = info.find(name);
    if (field == nullptr || field->chunk_bytes <= sizeof(double)) continue;  // no chunks
    const std::uint64_t kept = std::min(128 * mib, field->decoded_bytes / field->components.size());
    bytes = std::max(bytes, 64 * mib + std::max(kept, 2 * field->chunk_bytes));
  }
  return bytes;
}

// The same while it reads a box of a field, of which no chunks are kept.
inline std::uint64_t reading_box_bytes(const FieldInfo& field) {
  constexpr std::uint64_t mib = std::uint64_t{1} << 20;
  return field.chunk_bytes <= sizeof(double) ? 32 * mib : 48 * mib + 2 * field.chunk_bytes;
}

// The same of a store with levels, whose chunks are small and kept until all of their samples are
// read, up to 64 MiB.
inline std::uint64_t reading_bytes_of_store(const DatasetInfo& info,
                                            const std::vector<std::string>& fields) {
  constexpr std::uint64_t mib = std::uint64_t{1} << 20;
  const std::array<int, 3> dims = info.grid.dims();
  const std::uint64_t layer =
      static_cast<std::uint64_t>(dims[0]) * static_cast<std::uint64_t>(dims[1]) * sizeof(float);
  std::uint64_t kept = 0;
  for (const std::string& name : fields) {
    const FieldInfo* const field = info.find(name);
    const int layers = field == nullptr ? 0 : field->box_chunk[2];
    kept = std::max(kept, static_cast<std::uint64_t>(layers) * layer);
  }
  return 16 * mib + std::min(64 * mib, kept);
}

}  // namespace windsplat::data
