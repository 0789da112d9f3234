// The cache of brick summaries and its keys.
#include "server/engine/summaries.hpp"

#include <algorithm>
#include <bit>

namespace windsplat::engine {

namespace {

using Field = std::weak_ptr<const data::Volume>;

void add(std::vector<std::uint32_t>& key, float v) {
  key.push_back(std::bit_cast<std::uint32_t>(v));
}
void add(std::vector<std::uint32_t>& key, double v) {
  const auto bits = std::bit_cast<std::uint64_t>(v);
  key.push_back(static_cast<std::uint32_t>(bits));
  key.push_back(static_cast<std::uint32_t>(bits >> 32U));
}
void add(std::vector<std::uint32_t>& key, int v) { key.push_back(static_cast<std::uint32_t>(v)); }

void add(std::vector<std::uint32_t>& key, const float* values, int count) {
  add(key, values == nullptr ? -1 : count);
  for (int i = 0; values != nullptr && i < count; ++i) add(key, values[i]);
}

// Writes every number that Table::summarise reads besides the fields and the visit order.
void write_key(const kernels::Pass& pass, std::vector<std::uint32_t>& key) {
  key.clear();
  add(key, pass.major);
  add(key, pass.places != nullptr ? 1 : 0);
  for (int a = 0; a < 3; ++a) {
    const kernels::Axis& axis = pass.axis[a];
    add(key, pass.dims[a]);
    add(key, pass.cell_max[a]);
    add(key, axis.cell, axis.count);
    for (int s = 0; s < axis.count; ++s) add(key, axis.sample[s]);
  }
  add(key, pass.has_lines);
  if (pass.has_lines != 0) {
    const kernels::LineStyle& line = pass.line;
    add(key, line.scale, 3);
    // Rates are those of the samples that are drawn from the data.
    const int* const dims = line.merged != 0 ? line.data_dims : pass.dims;
    for (int a = 0; a < 3; ++a) add(key, line.halvings[a]);
    add(key, line.data_stride);
    add(key, line.rate_x, dims[1]);
    add(key, line.rate_y);
    add(key, line.rate_z, dims[2]);
    add(key, line.magnitude_scale);
    add(key, line.unscaled_min_magnitude);
    add(key, line.inverse_full_magnitude);
    add(key, line.min_magnitude);
  }
  add(key, pass.has_medium);
  if (pass.has_medium == 0) return;
  add(key, pass.medium.layers);
  add(key, pass.medium.min_optical_depth);
  for (int k = 0; k < pass.medium.layers; ++k) {
    const kernels::Extinction& extinction = pass.medium.layer[k].extinction;
    add(key, extinction.x, extinction.points);
    add(key, extinction.y, extinction.points);
    add(key, extinction.slope, extinction.points);
  }
}

// Compares owners rather than addresses: a weak pointer keeps the control block of its owner from
// being reused. A field without an owner never matches.
bool same_field(const Field& kept, const std::shared_ptr<const data::Volume>& field) {
  return field.use_count() > 0 && !kept.owner_before(field) && !field.owner_before(kept);
}

}  // namespace

struct SummaryCache::Entry {
  const kernels::Table* table = nullptr;
  std::vector<Field> fields;
  std::vector<const data::Volume*> volumes;  // one owner may hold several volumes
  std::vector<std::uint32_t> key;
  std::uint64_t used = 0;  // frame of the last use
  PassSummaries kept;

  [[nodiscard]] std::size_t bytes() const { return kept.bytes(); }
  [[nodiscard]] bool has_fields_of(const PassPlan& pass) const;
  void reset();
  void begin(const PassPlan& pass);
};

namespace {

int bricks_of(int positions) { return (positions + kernels::brick_side - 1) / kernels::brick_side; }

// The bricks of a pass; of a grid of boxes those of the boxes that it holds.
std::size_t summaries_of(const PassPlan& pass) {
  const kernels::Pass& kernel = pass.kernel;
  const bool is_grid = !pass.box_places.empty();
  std::size_t bricks =
      is_grid ? *std::max_element(pass.box_places.begin(), pass.box_places.end()) + 1U : 1U;
  for (int a = 0; a < 3; ++a) {
    const int positions = is_grid ? kernel.box_kernels[a] : kernel.axis[a].count;
    bricks *= static_cast<std::size_t>(a == kernel.major ? positions : bricks_of(positions));
  }
  return bricks;
}

template <class Visit>
void each_field(const PassPlan& pass, const Visit& visit) {
  if (pass.vector != nullptr) {
    const auto& segments = pass.vector->streamlets;
    // Of curved lines, the segments are what is read.
    visit(segments ? std::shared_ptr<const data::Volume>(segments, pass.vector->field.get())
                   : pass.vector->field);
  }
  for (const scene::ScalarLayer* scalar : pass.scalars) visit(scalar->field);
}

}  // namespace

bool SummaryCache::Entry::has_fields_of(const PassPlan& pass) const {
  std::size_t n = 0;
  bool same = true;
  each_field(pass, [&](const std::shared_ptr<const data::Volume>& field) {
    same = same && n < fields.size() && volumes[n] == field.get() && same_field(fields[n], field);
    ++n;
  });
  return same && n == fields.size();
}

void SummaryCache::Entry::reset() { *this = Entry(); }

void SummaryCache::Entry::begin(const PassPlan& pass) {
  fields.clear();
  volumes.clear();
  each_field(pass, [&](const std::shared_ptr<const data::Volume>& field) {
    fields.emplace_back(field);
    volumes.push_back(field.get());
  });
  kept.begin(pass);
}

std::size_t PassSummaries::bytes() const {
  return bricks.capacity() * sizeof(KeptSummary) + blank_regions.capacity() +
         places.capacity() * sizeof(int);
}

void PassSummaries::begin(const PassPlan& pass) {
  const kernels::Pass& kernel = pass.kernel;
  const auto along = [&](int a) { return bricks_of(kernel.axis[a].count); };
  u_bricks = along(kernel.u);
  v_bricks = along(kernel.v);
  layers = kernel.axis[kernel.major].count;
  regions = along(kernel.major);
  places = pass.box_places;
  if (!places.empty()) {
    const std::array<int, 3> steps{1, kernel.box_counts[0],
                                   kernel.box_counts[0] * kernel.box_counts[1]};
    box = {kernel.box_kernels[kernel.major], bricks_of(kernel.box_kernels[kernel.v]),
           bricks_of(kernel.box_kernels[kernel.u])};
    box_step = {steps[kernel.major], steps[kernel.v], steps[kernel.u]};
  }
  bricks.assign(summaries_of(pass), KeptSummary());
  blank_regions.assign(static_cast<std::size_t>(u_bricks) * v_bricks * regions, 0);
}

bool PassSummaries::find_blank(int region_layer, int v, int u) {
  const int first = region_layer * kernels::brick_side;
  const int last = std::min(first + kernels::brick_side, layers);
  for (int layer = first; layer < last; ++layer) {
    if (!bricks[brick(layer, v, u)].blank()) return false;
  }
  blank_regions[region(first, v, u)] = 1;
  return true;
}

SummaryCache::SummaryCache() = default;
SummaryCache::~SummaryCache() = default;

std::size_t SummaryCache::bytes() const {
  std::size_t sum = 0;
  for (const auto& entry : entries_) sum += entry->bytes();
  return sum;
}

// Returns a new entry or, if the cache is full, the least recently used one not used by this frame.
SummaryCache::Entry& SummaryCache::replaceable() {
  Entry* oldest = nullptr;
  for (const auto& entry : entries_) {
    if (entry->used < frame_ && (oldest == nullptr || entry->used < oldest->used)) {
      oldest = entry.get();
    }
  }
  if (oldest != nullptr && entries_.size() >= passes_max) return *oldest;
  return *entries_.emplace_back(std::make_unique<Entry>());
}

// Resets the least recently used entries until `coming` more bytes stay within the limit.
void SummaryCache::trim_storage(std::size_t coming) {
  while (bytes() + coming > bytes_max) {
    Entry* oldest = nullptr;
    for (const auto& entry : entries_) {
      const bool held = entry->bytes() > 0 && entry->used < frame_;
      if (held && (oldest == nullptr || entry->used < oldest->used)) oldest = entry.get();
    }
    if (oldest == nullptr) return;
    oldest->reset();
  }
}

PassSummaries& SummaryCache::of(const PassPlan& pass, const kernels::Table& table) {
  write_key(pass.kernel, key_);
  for (const auto& entry : entries_) {
    if (entry->table == &table && entry->key == key_ && entry->has_fields_of(pass)) {
      entry->used = frame_;
      return entry->kept;
    }
  }
  Entry& entry = replaceable();
  entry.used = frame_;
  const std::size_t needed = summaries_of(pass) * sizeof(KeptSummary);
  // Release the storage of an entry that is far too large.
  if (entry.bytes() > 4 * needed + 65536) {
    entry.reset();
    entry.used = frame_;
  }
  trim_storage(needed > entry.bytes() ? needed - entry.bytes() : 0);
  entry.table = &table;
  entry.key = key_;
  entry.begin(pass);
  return entry.kept;
}

KeptSummary summarise(const kernels::Table& table, const kernels::Pass& in_order,
                      const kernels::Brick& brick) {
  kernels::BrickSummary found;
  table.summarise(in_order, brick, 0.0F, found);
  KeptSummary kept;
  kept.weak_parts = found.weak_parts;
  kept.thin_medium = found.thin_medium;
  kept.magnitude_max = found.magnitude_max;
  kept.lines = static_cast<std::uint8_t>(found.lines);
  kept.splats = static_cast<std::uint8_t>(found.splats);
  kept.without_both = static_cast<std::uint8_t>(found.without_both);
  kept.weak_lines = static_cast<std::uint8_t>(found.weak_lines);
  return kept;
}

}  // namespace windsplat::engine
