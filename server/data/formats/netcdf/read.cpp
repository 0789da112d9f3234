// Reads blocks through the netCDF library, and masks unwritten chunks reported by HDF5.
#include <netcdf.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/formats/netcdf/dates.hpp"
#include "server/data/formats/netcdf/file.hpp"

namespace windsplat::data::netcdf {

namespace {

// Limit on the caches of all variables together, but at least one chunk; resident.cpp accounts for
// it.
constexpr double kept_bytes_max = 128 << 20;
// HDF5 numbers chunks by a power of two along each dimension, and chunks whose numbers are equal
// modulo the slots (a prime) replace each other. A layer of 1000 chunks (cf::level_parts()) has
// numbers below 4000.
constexpr std::size_t slots_min = 4133;

// A scalar has no extent, but the library requires a valid pointer.
const std::size_t* place(const std::vector<std::size_t>& lengths) {
  static constexpr std::size_t none = 0;
  return lengths.empty() ? &none : lengths.data();
}

}  // namespace

std::vector<std::size_t> File::chunk(int variable) const {
  const std::size_t rank = contents_.variables.at(static_cast<std::size_t>(variable)).dims.size();
  if (variable == dates_) return {1};
  std::vector<std::size_t> lengths(rank, 1);
  const LibraryLock lock;
  const auto [group, id] = place_of(variable);
  int storage = NC_CONTIGUOUS;
  if (rank == 0 || classic_ ||
      nc_inq_var_chunking(group, id, &storage, lengths.data()) != NC_NOERR ||
      storage != NC_CHUNKED) {
    std::fill(lengths.begin(), lengths.end(), 1);
  }
  return lengths;
}

std::size_t File::chunk_cost_bytes(int variable) const {
  const bool is_chunked = !classic_ && !storage_.at(paths_.at(cf::at(variable))).chunk.empty();
  return is_chunked ? hdf5_chunk_cost_bytes : 0;
}

void File::forget_chunks(int variable) const {
  if (classic_) return;
  const LibraryLock lock;
  free_chunks(variable);
}

void File::free_chunks(int variable) const {
  kept_.remove_if([variable](const auto& kept) { return kept.first == variable; });
  const auto [group, id] = place_of(variable);
  std::size_t size = 0;
  std::size_t slots = 0;
  float preemption = 0;
  // Setting the cache size, even to the same value, makes the library reopen the variable, which
  // frees its chunks. A failure only leaves memory in use.
  if (nc_get_var_chunk_cache(group, id, &size, &slots, &preemption) == NC_NOERR) {
    nc_set_var_chunk_cache(group, id, size, slots, preemption);
  }
}

// Caches chunks shared by consecutive blocks within the limit, so that they are decoded once.
void File::keep_chunks(int variable, const Block& block) const {
  const DatasetStorage& storage = storage_.at(paths_.at(cf::at(variable)));
  if (storage.chunk.empty()) return;
  double one = static_cast<double>(storage.item_bytes);
  double all = one;
  for (std::size_t d = 0; d < storage.chunk.size(); ++d) {
    if (block.count[d] == 0) return;
    const std::size_t length = storage.chunk[d];
    const std::size_t first = block.start[d] / length;
    const std::size_t last = (block.start[d] + block.count[d] - 1) / length;
    const std::size_t along = (last - first + 1) * length;
    one *= static_cast<double>(length);
    all *= static_cast<double>(along);
  }
  const auto wanted = static_cast<std::size_t>(all <= kept_bytes_max ? all : one);
  const auto [group, id] = place_of(variable);
  std::size_t size = 0;
  std::size_t slots = 0;
  float preemption = 0;
  if (nc_get_var_chunk_cache(group, id, &size, &slots, &preemption) != NC_NOERR) return;
  if (storage.filtered && size < wanted) {
    nc_set_var_chunk_cache(group, id, wanted, std::max(slots, slots_min), preemption);
    size = wanted;
  }
  forget_others(variable, size);
}

// Frees the caches of the least recently read variables until all fit the limit.
void File::forget_others(int variable, std::size_t bytes) const {
  kept_.remove_if([variable](const auto& kept) { return kept.first == variable; });
  auto total = static_cast<double>(bytes);
  for (const auto& kept : kept_) total += static_cast<double>(kept.second);
  while (!kept_.empty() && total > kept_bytes_max) {
    const auto [oldest, its_bytes] = kept_.back();
    total -= static_cast<double>(its_bytes);
    free_chunks(oldest);
  }
  kept_.emplace_front(variable, bytes);
}

cf::Unwritten File::unwritten(int variable, std::size_t most) const {
  if (classic_) return {};
  const LibraryLock lock;
  const std::string& path = paths_.at(cf::at(variable));
  const DatasetStorage& storage = storage_.at(path);
  return OpenDataset(hdf5_, path, storage, absent_[storage.object]).count_absent(most);
}

template <class T, class Get>
Result<void> File::read_block(int variable, const Block& block, T* out, const Get& get) const {
  const LibraryLock lock;
  // A file truncated while open would yield zeros instead of an error.
  if (auto same = input_->check_unchanged(); !same) {
    return same;
  }
  const std::string& name = contents_.variables.at(cf::at(variable)).name;
  std::optional<OpenDataset> dataset;
  if (!classic_) {
    const std::string& path = paths_.at(cf::at(variable));
    const DatasetStorage& storage = storage_.at(path);
    keep_chunks(variable, block);  // first: the cache size of an open dataset is fixed
    dataset.emplace(hdf5_, path, storage, absent_[storage.object]);
    if (auto fine = dataset->check(block); !fine) {
      return fault("is damaged: " + in_quotes(name) + ' ' + fine.error().message);
    }
  }
  if (const int status = get(); status != NC_NOERR) {
    return fault("is damaged: " + in_quotes(name) + " cannot be read (" + nc_strerror(status) +
                 ")");
  }
  if (dataset) dataset->mask(block, out);
  return {};
}

// Characters of unwritten chunks are no date. block: of the dimension of time.
Result<void> File::read_dates(const Block& block, double* out) const {
  const std::vector<std::size_t> start{block.start.at(0), 0};
  std::size_t width = 0;
  {
    const LibraryLock lock;
    const auto [group, id] = place_of(dates_);
    std::array<int, 2> dims{};
    int rank = 0;
    if (nc_inq_varndims(group, id, &rank) != NC_NOERR || rank != 2 ||
        nc_inq_vardimid(group, id, dims.data()) != NC_NOERR ||
        nc_inq_dimlen(group, dims[1], &width) != NC_NOERR || width < date_length ||
        width > date_width_max) {
      return fault("is damaged: the characters of " +
                   in_quotes(contents_.variables.at(cf::at(dates_)).name) + " cannot be read");
    }
  }
  const std::vector<std::size_t> count{block.count.at(0), width};
  std::string text(count[0] * width, ' ');
  std::vector<double> absent(text.size(), 0);
  auto done = read_block(dates_, {start, count}, absent.data(), [&] {
    const auto [group, id] = place_of(dates_);
    return nc_get_vara_text(group, id, place(start), place(count), text.data());
  });
  if (!done) return done;
  const auto calendar = cf::parse_calendar(contents_.variables.at(cf::at(dates_)).calendar);
  for (std::size_t i = 0; i < count[0]; ++i) {
    const double masked = absent[i * width];
    out[i] = masked + seconds_of_date(std::string_view(text).substr(i * width, width),
                                      calendar.value_or(cf::Calendar::proleptic_gregorian));
  }
  return {};
}

Result<void> File::read(int variable, const std::vector<std::size_t>& start,
                        const std::vector<std::size_t>& count, double* out) const {
  if (variable == dates_) return read_dates({start, count}, out);
  return read_block(variable, {start, count}, out, [&] {
    const auto [group, id] = place_of(variable);
    return nc_get_vara_double(group, id, place(start), place(count), out);
  });
}

Result<void> File::read(int variable, const std::vector<std::size_t>& start,
                        const std::vector<std::size_t>& count, float* out) const {
  return read_block(variable, {start, count}, out, [&] {
    const auto [group, id] = place_of(variable);
    return nc_get_vara_float(group, id, place(start), place(count), out);
  });
}

}  // namespace windsplat::data::netcdf
