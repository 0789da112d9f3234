// Visits all links before the netCDF library opens the file; later examines chunks.
#include "server/data/formats/netcdf/hdf5_storage.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <new>
#include <unordered_map>
#include <utility>

#include "server/data/bytes/decode_limits.hpp"

namespace windsplat::data::netcdf {

namespace {

constexpr std::size_t nesting_max = 64;  // limit on groups within groups

// Largest number of objects in a file of a given size: the smallest object has about 300 bytes, but
// a link only about 20, and the netCDF library uses some kB for each.
std::size_t objects_max(const InputFile& input) { return 8192 + input.size() / 128; }

std::string bytes_text(std::size_t bytes) { return std::to_string(bytes) + " bytes"; }

std::string virtual_problem(hid_t plan) {
  std::array<char, 256> source{};
  std::string text = "a virtual dataset, whose data are elsewhere";
  if (H5Pget_virtual_filename(plan, 0, source.data(), source.size()) > 0) {
    text += " ('" + printable(source.data()) + "')";
  }
  return text + ", which is not supported";
}

std::string external_problem(hid_t plan) {
  std::array<char, 256> name{};
  off_t offset = 0;
  hsize_t size = 0;
  std::string text = "in another file";
  if (H5Pget_external(plan, 0, name.size() - 1, name.data(), &offset, &size) >= 0) {
    text += " ('" + printable(name.data()) + "')";
  }
  return text + ", which is not supported";
}

// The first filter that this build of the library cannot decode; empty if there is none.
std::string filter_problem(hid_t plan) {
  const int filters = H5Pget_nfilters(plan);
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0;
    unsigned config = 0;
    std::size_t values = 0;
    std::array<char, 64> name{};
    const H5Z_filter_t id = H5Pget_filter2(plan, static_cast<unsigned>(i), &flags, &values, nullptr,
                                           name.size() - 1, name.data(), &config);
    const bool known = id >= 0 && H5Zfilter_avail(id) > 0 && H5Zget_filter_info(id, &config) >= 0 &&
                       (config & H5Z_FILTER_CONFIG_DECODE_ENABLED) != 0;
    if (!known) {
      std::string text = "encoded with the filter " + std::to_string(id);
      if (name[0] != '\0') text += " ('" + printable(name.data()) + "')";
      return text + ", which is not available";
    }
  }
  return {};
}

// Whether number_of() is unique for each chunk.
bool can_be_numbered(const DatasetStorage& storage) {
  std::uint64_t chunks = 1;
  for (std::size_t d = 0; d < storage.chunk.size(); ++d) {
    const std::uint64_t whole = storage.extent[d] / storage.chunk[d];
    if (whole >= std::numeric_limits<std::uint64_t>::max() / chunks) return false;
    chunks *= whole + 1;
  }
  return true;
}

DatasetStorage storage_of(hid_t dataset) {
  DatasetStorage out;
  const Handle plan(H5Dget_create_plist(dataset), H5Pclose);
  const Handle space(H5Dget_space(dataset), H5Sclose);
  const Handle type(H5Dget_type(dataset), H5Tclose);
  std::array<hsize_t, H5S_MAX_RANK> lengths{};
  const int rank = space ? H5Sget_simple_extent_dims(space.id(), lengths.data(), nullptr) : -1;
  if (!plan || !type || rank < 0) {
    out.problem = "its description is damaged";
    return out;
  }
  out.extent.assign(lengths.begin(), lengths.begin() + rank);
  out.item_bytes = H5Tget_size(type.id());
  const H5D_layout_t layout = H5Pget_layout(plan.id());
  if (layout == H5D_VIRTUAL) {
    out.problem = virtual_problem(plan.id());
  } else if (H5Pget_external_count(plan.id()) > 0) {
    out.problem = external_problem(plan.id());
  } else if (layout == H5D_CHUNKED) {
    if (H5Pget_chunk(plan.id(), rank, lengths.data()) != rank) {
      out.problem = "its description is damaged";
      return out;
    }
    out.chunk.assign(lengths.begin(), lengths.begin() + rank);
    out.filtered = H5Pget_nfilters(plan.id()) > 0;
    out.problem = filter_problem(plan.id());
    std::size_t bytes = out.item_bytes;
    for (const hsize_t length : out.chunk) {
      const bool fits = length > 0 && bytes <= chunk_bytes_max / length;
      bytes =
          fits ? bytes * static_cast<std::size_t>(length) : std::numeric_limits<std::size_t>::max();
      if (!fits) break;
    }
    if (bytes > chunk_bytes_max) {
      out.problem = "its chunks have more than " + bytes_text(chunk_bytes_max);
    } else if (!can_be_numbered(out)) {
      out.problem = "it has more chunks than can be counted";
    }
  } else if (layout == H5D_CONTIGUOUS) {
    out.written = H5Dget_offset(dataset) != HADDR_UNDEF;
  }
  return out;
}

// Depth first, like the netCDF library: an object is visited once per link.
class StorageScan {
 public:
  explicit StorageScan(const InputFile& input) : input_(input), objects_left_(objects_max(input)) {}

  Result<std::map<std::string, DatasetStorage>> take() {
    const Handle file = open_hdf5(input_);
    if (!file) {
      return input_.fault("cannot be read as HDF5: it is truncated or damaged");
    }
    const Handle root(H5Gopen2(file.id(), "/", H5P_DEFAULT), H5Gclose);
    const bool listed = root && visit_group(root.id(), "");
    if (out_of_memory_) throw std::bad_alloc();
    if (!listed || !fault_.empty()) {
      return input_.fault(fault_.empty() ? "is damaged: its groups cannot be listed" : fault_);
    }
    return std::move(found_);
  }

 private:
  static herr_t on_link(hid_t group, const char* name, const H5L_info_t* about, void* self) {
    auto& scan = *static_cast<StorageScan*>(self);
    try {
      return scan.visit_link(group, name, *about) ? 0 : -1;
    } catch (const std::exception&) {  // must not unwind the library's C frames
      scan.out_of_memory_ = true;
      return -1;
    }
  }

  bool fail(std::string what) {
    if (fault_.empty()) fault_ = std::move(what);
    return false;
  }

  bool visit_group(hid_t group, const std::string& path) {
    H5O_info_t about{};
    if (H5Oget_info2(group, &about, H5O_INFO_BASIC) < 0) return false;
    if (std::find(above_.begin(), above_.end(), about.addr) != above_.end()) {
      return fail("has a group that contains itself: '" + printable(path) + "'");
    }
    if (above_.size() > nesting_max) {
      return fail("has groups within groups, more than " + std::to_string(nesting_max) + " deep");
    }
    above_.push_back(about.addr);
    const std::string outer = std::exchange(path_, path);
    const bool done =
        H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, &StorageScan::on_link, this) >= 0;
    path_ = outer;
    above_.pop_back();
    return done;
  }

  bool visit_link(hid_t group, const char* name, const H5L_info_t& link) {
    const std::string path = path_ + '/' + name;
    if (objects_left_-- == 0) {
      return fail("has more than " + std::to_string(objects_max(input_)) +
                  " groups and variables, for " + bytes_text(input_.size()));
    }
    if (link.type == H5L_TYPE_EXTERNAL) return fail(external_link(group, name, path, link));
    H5O_info_t about{};
    if (H5Oget_info_by_name2(group, name, &about, H5O_INFO_BASIC, H5P_DEFAULT) < 0) {
      return fail(link.type == H5L_TYPE_HARD
                      ? "is damaged: '" + printable(path) + "' cannot be read"
                      : "has a link that leads nowhere: '" + printable(path) + "'");
    }
    if (about.type == H5O_TYPE_GROUP) {
      const Handle inner(H5Gopen2(group, name, H5P_DEFAULT), H5Gclose);
      return inner && visit_group(inner.id(), path);
    }
    if (about.type == H5O_TYPE_DATASET) return visit_dataset(group, name, path, about.addr);
    return true;
  }

  static std::string external_link(hid_t group, const char* name, const std::string& path,
                                   const H5L_info_t& link) {
    std::string text = "has an external link, which is not followed: '" + printable(path) + "'";
    std::vector<char> value(link.u.val_size + 1, '\0');
    const char* file = nullptr;
    const char* object = nullptr;
    unsigned flags = 0;
    if (link.u.val_size < 65536 &&
        H5Lget_val(group, name, value.data(), link.u.val_size, H5P_DEFAULT) >= 0 &&
        H5Lunpack_elink_val(value.data(), link.u.val_size, &flags, &file, &object) >= 0) {
      text += " to '" + printable(file) + "'";
    }
    return text;
  }

  bool visit_dataset(hid_t group, const char* name, const std::string& path, haddr_t address) {
    auto known = by_address_.find(address);
    if (known == by_address_.end()) {
      const Handle dataset(H5Dopen2(group, name, H5P_DEFAULT), H5Dclose);
      if (!dataset) return fail("is damaged: '" + printable(path) + "' cannot be read");
      known = by_address_.emplace(address, storage_of(dataset.id())).first;
      known->second.object = address;
    }
    found_.emplace(path, known->second);
    return true;
  }

  const InputFile& input_;
  std::size_t objects_left_;
  std::string fault_;
  bool out_of_memory_ = false;
  std::string path_;            // path of the current group
  std::vector<haddr_t> above_;  // the current group and its parents
  std::unordered_map<haddr_t, DatasetStorage> by_address_;
  std::map<std::string, DatasetStorage> found_;
};

enum class ChunkState { present, absent, broken };

// Sets a box of a block to NaN.
template <class T>
void fill_box(const Block& block, const std::vector<std::size_t>& first,
              const std::vector<std::size_t>& end, T* out) {
  const std::size_t rank = first.size();
  const std::size_t row = rank == 0 ? 1 : end.back() - first.back();
  std::vector<std::size_t> at = first;
  for (;;) {
    std::size_t offset = 0;
    for (std::size_t d = 0; d < rank; ++d) {
      offset = offset * block.count[d] + (at[d] - block.start[d]);
    }
    std::fill_n(out + offset, row, std::numeric_limits<T>::quiet_NaN());
    std::size_t d = rank == 0 ? 0 : rank - 1;
    for (; d > 0; --d) {
      if (++at[d - 1] < end[d - 1]) break;
      at[d - 1] = first[d - 1];
    }
    if (d == 0) return;
  }
}

}  // namespace

Handle& Handle::operator=(Handle&& other) noexcept {
  if (id_ >= 0) close_(id_);
  id_ = std::exchange(other.id_, -1);
  close_ = other.close_;
  return *this;
}

Handle::~Handle() {
  if (id_ >= 0) close_(id_);
}

Result<std::map<std::string, DatasetStorage>> scan_storage(const InputFile& input) {
  return StorageScan(input).take();
}

// Uses the same close degree as the netCDF library; HDF5 rejects opening a file with different
// ones.
Handle open_hdf5(const InputFile& input) {
  return {H5Fopen(input.library_path().c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose};
}

OpenDataset::OpenDataset(const Handle& file, const std::string& path, const DatasetStorage& storage,
                         AbsentChunks& absent)
    : storage_(storage), absent_(absent) {
  if (storage.chunk.empty()) return;
  dataset_ = Handle(H5Dopen2(file.id(), path.c_str(), H5P_DEFAULT), H5Dclose);
}

// Visits the unwritten boxes of a block: everything beyond the extent, and the chunks that
// chunk(first item) reports as absent. Returns false if chunk() reports one as broken.
template <class Absent, class Chunk>
bool OpenDataset::walk(const Block& block, const Absent& absent, const Chunk& chunk) const {
  const std::size_t rank = storage_.extent.size();
  if (rank != block.start.size()) return false;
  if (std::find(block.count.begin(), block.count.end(), std::size_t{0}) != block.count.end()) {
    return true;
  }
  Box inside{block.start, block.start};
  for (std::size_t d = 0; d < rank; ++d) inside.end[d] += block.count[d];
  if (!storage_.written) {
    absent(inside);
    return true;
  }
  for (std::size_t d = 0; d < rank; ++d) {
    const auto extent = static_cast<std::size_t>(storage_.extent[d]);
    if (inside.end[d] <= extent) continue;
    Box beyond = inside;
    beyond.first[d] = std::max(block.start[d], extent);
    absent(beyond);
    if (block.start[d] >= extent) return true;
    inside.end[d] = extent;
  }
  return storage_.chunk.empty() || walk_chunks(inside, absent, chunk);
}

template <class Absent, class Chunk>
bool OpenDataset::walk_chunks(const Box& inside, const Absent& absent, const Chunk& chunk) const {
  const std::size_t rank = storage_.chunk.size();
  std::vector<hsize_t> first(rank);
  for (std::size_t d = 0; d < rank; ++d) {
    first[d] = inside.first[d] / storage_.chunk[d] * storage_.chunk[d];
  }
  std::vector<hsize_t> at = first;
  Box here = inside;
  for (;;) {
    const ChunkState state = chunk(at);
    if (state == ChunkState::broken) return false;
    if (state == ChunkState::absent) {
      for (std::size_t d = 0; d < rank; ++d) {
        here.first[d] = std::max<std::size_t>(inside.first[d], at[d]);
        here.end[d] = std::min<std::size_t>(inside.end[d], at[d] + storage_.chunk[d]);
      }
      absent(here);
    }
    std::size_t d = rank;
    for (; d > 0; --d) {
      at[d - 1] += storage_.chunk[d - 1];
      if (at[d - 1] < inside.end[d - 1]) break;
      at[d - 1] = first[d - 1];
    }
    if (d == 0) return true;
  }
}

std::uint64_t OpenDataset::number_of(const std::vector<hsize_t>& at) const {
  std::uint64_t number = 0;
  for (std::size_t d = 0; d < at.size(); ++d) {
    number = number * (storage_.extent[d] / storage_.chunk[d] + 1) + at[d] / storage_.chunk[d];
  }
  return number;
}

// Returns 0 for an unwritten chunk and records it.
hsize_t OpenDataset::stored_bytes(const std::vector<hsize_t>& at) {
  const std::uint64_t number = number_of(at);
  if (absent_.count(number) > 0) return 0;
  hsize_t bytes = 0;
  // The library reports an absent chunk as an error; corruption is detected by the read.
  if (H5Dget_chunk_storage_size(dataset_.id(), at.data(), &bytes) < 0 || bytes == 0) {
    absent_.insert(number);
    return 0;
  }
  return bytes;
}

cf::Unwritten OpenDataset::count_absent(std::size_t most) {
  if (!storage_.written) return {1, 1, true};
  const bool is_empty = std::find(storage_.extent.begin(), storage_.extent.end(), hsize_t{0}) !=
                        storage_.extent.end();
  if (storage_.chunk.empty() || !dataset_ || is_empty) return {};
  Box all;
  all.first.assign(storage_.extent.size(), 0);
  all.end.assign(storage_.extent.begin(), storage_.extent.end());
  cf::Unwritten out;
  out.is_all = walk_chunks(
      all, [](const Box&) {},
      [&](const std::vector<hsize_t>& at) {
        if (out.looked_at == most) return ChunkState::broken;  // ends the traversal
        ++out.looked_at;
        if (stored_bytes(at) > 0) return ChunkState::present;
        ++out.chunks;
        return ChunkState::absent;
      });
  return out;
}

Result<void> OpenDataset::check(const Block& block) {
  std::uint64_t chunk_bytes = storage_.item_bytes;
  for (const hsize_t length : storage_.chunk) chunk_bytes *= length;
  if (!storage_.chunk.empty() && !dataset_) {
    return make_error(ErrorKind::bad_data, "cannot be opened");
  }
  const bool fine = walk(
      block, [&](const Box&) { any_absent_ = true; },
      [&](const std::vector<hsize_t>& at) {
        const hsize_t bytes = stored_bytes(at);
        if (bytes == 0) return ChunkState::absent;
        return bytes > stored_chunk_bytes_max(chunk_bytes) ? ChunkState::broken
                                                           : ChunkState::present;
      });
  if (fine) return {};
  return make_error(ErrorKind::bad_data, "has a chunk with more bytes than its array can need");
}

template <class T>
void OpenDataset::mask(const Block& block, T* out) const {
  if (!any_absent_) return;
  walk(
      block, [&](const Box& box) { fill_box(block, box.first, box.end, out); },
      [&](const std::vector<hsize_t>& at) {
        return absent_.count(number_of(at)) > 0 ? ChunkState::absent : ChunkState::present;
      });
}

template void OpenDataset::mask(const Block& block, float* out) const;
template void OpenDataset::mask(const Block& block, double* out) const;

}  // namespace windsplat::data::netcdf
