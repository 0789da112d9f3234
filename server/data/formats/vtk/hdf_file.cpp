// Reads blocks of datasets through the HDF5 library, after its file was examined.
#include "server/data/formats/vtk/hdf_file.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <functional>
#include <numeric>
#include <set>
#include <type_traits>
#include <utility>

#include "server/base/check.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/formats/netcdf/file.hpp"

namespace windsplat::data::vtk {

namespace {

using netcdf::Handle;
using netcdf::LibraryLock;

constexpr std::uint64_t hdf_growth_max = 1040;  // of deflate
constexpr std::size_t listed_values_max = std::size_t{1} << 20;
constexpr std::uint64_t slab_values = std::uint64_t{1} << 19;
constexpr std::uint64_t slab_values_max = std::uint64_t{1} << 25;
constexpr std::size_t text_bytes_most = 64;

// The type of numbers of a dataset; nullopt for others.
std::optional<bytes::Scalar> scalar_of(hid_t type) {
  const H5T_class_t kind = H5Tget_class(type);
  const std::size_t size = H5Tget_size(type);
  if (kind == H5T_FLOAT) {
    if (size == 4) return bytes::Scalar::float32;
    if (size == 8) return bytes::Scalar::float64;
    return {};
  }
  if (kind != H5T_INTEGER) return {};
  const bool has_sign = H5Tget_sign(type) == H5T_SGN_2;
  switch (size) {
    case 1:
      return has_sign ? bytes::Scalar::int8 : bytes::Scalar::uint8;
    case 2:
      return has_sign ? bytes::Scalar::int16 : bytes::Scalar::uint16;
    case 4:
      return has_sign ? bytes::Scalar::int32 : bytes::Scalar::uint32;
    case 8:
      return has_sign ? bytes::Scalar::int64 : bytes::Scalar::uint64;
    default:
      return {};
  }
}

hid_t memory_type(bytes::Scalar type) {
  switch (type) {
    case bytes::Scalar::int8:
      return H5T_NATIVE_INT8;
    case bytes::Scalar::uint8:
      return H5T_NATIVE_UINT8;
    case bytes::Scalar::int16:
      return H5T_NATIVE_INT16;
    case bytes::Scalar::uint16:
      return H5T_NATIVE_UINT16;
    case bytes::Scalar::int32:
      return H5T_NATIVE_INT32;
    case bytes::Scalar::uint32:
      return H5T_NATIVE_UINT32;
    case bytes::Scalar::int64:
      return H5T_NATIVE_INT64;
    case bytes::Scalar::uint64:
      return H5T_NATIVE_UINT64;
    case bytes::Scalar::float32:
      return H5T_NATIVE_FLOAT;
    case bytes::Scalar::float64:
      return H5T_NATIVE_DOUBLE;
  }
  return -1;
}

// Reads slabs of whole chunks along the first dimension of a part, so that each chunk is decoded
// once. Slab: float or double.
template <class Slab>
class HdfStream final : public ArrayStream {
 public:
  explicit HdfStream(const StoredArray& array)
      : part_(array.hdf), type_(array.type), at_(part_->start.at(part_->along)) {
    for (std::size_t d = 0; d < part_->count.size(); ++d) {
      if (d != part_->along) row_ *= part_->count[d];
    }
  }

  Result<void> read(double* out, std::size_t count) override { return read_as(out, count); }
  Result<void> read(float* out, std::size_t count) override { return read_as(out, count); }

 private:
  template <class Out>
  Result<void> read_as(Out* out, std::size_t count) {
    while (count > 0) {
      if (used_ == slab_.size()) {
        if constexpr (std::is_same_v<Out, Slab>) {
          // A slab that is wanted as a whole needs no copy.
          const std::uint64_t whole = rows_of_slab(count / row_) * row_;
          if (whole > 0 && whole <= count) {
            if (auto done = read_rows(whole / row_, out); !done) return done;
            out += whole;
            count -= static_cast<std::size_t>(whole);
            continue;
          }
        }
        const std::uint64_t rows = rows_of_slab(slab_values / row_);
        slab_.resize(static_cast<std::size_t>(rows * row_));
        used_ = 0;
        if (auto done = read_rows(rows, slab_.data()); !done) return done;
      }
      const std::size_t part = std::min(count, slab_.size() - used_);
      std::copy_n(slab_.begin() + static_cast<std::ptrdiff_t>(used_), part, out);
      used_ += part;
      out += part;
      count -= part;
    }
    return {};
  }

  // From here to the end of a chunk, and about as many rows as wanted, in whole chunks.
  [[nodiscard]] std::uint64_t rows_of_slab(std::uint64_t wanted) const {
    const std::size_t along = part_->along;
    const std::uint64_t end = part_->start[along] + part_->count[along];
    WINDSPLAT_CHECK(at_ < end);
    std::uint64_t rows = std::max<std::uint64_t>(1, wanted);
    rows = std::max<std::uint64_t>(1, rows / part_->chunk) * part_->chunk - at_ % part_->chunk;
    rows = std::min(rows, std::max<std::uint64_t>(1, slab_values_max / row_));
    return std::min(rows, end - at_);
  }

  Result<void> read_rows(std::uint64_t rows, Slab* out) {
    const std::size_t along = part_->along;
    std::vector<std::size_t> start(part_->start.begin(), part_->start.end());
    std::vector<std::size_t> size(part_->count.begin(), part_->count.end());
    start[along] = static_cast<std::size_t>(at_);
    size[along] = static_cast<std::size_t>(rows);
    at_ += rows;
    return part_->file->read(*part_, type_, start, size, out);
  }

  std::shared_ptr<const HdfPart> part_;
  bytes::Scalar type_;
  std::uint64_t at_;
  std::uint64_t row_ = 1;  // values for each item along the first dimension
  std::vector<Slab> slab_;
  std::size_t used_ = 0;
};

}  // namespace

std::unique_ptr<ArrayStream> hdf_stream(const StoredArray& array) {
  if (array.type == bytes::Scalar::float32) return std::make_unique<HdfStream<float>>(array);
  return std::make_unique<HdfStream<double>>(array);
}

bool HdfFile::is_vtkhdf(const InputFile& input) { return has_vtkhdf(input).value_or(false); }

std::optional<bool> HdfFile::has_vtkhdf(const InputFile& input) {
  const auto head = input.head(8);
  if (!head || *head != "\x89HDF\r\n\x1a\n") return std::nullopt;
  const LibraryLock lock;
  const Handle file = netcdf::open_hdf5(input);
  H5L_info_t about{};
  if (!file) return std::nullopt;
  return H5Lexists(file.id(), "VTKHDF", H5P_DEFAULT) > 0 &&
         H5Lget_info(file.id(), "VTKHDF", &about, H5P_DEFAULT) >= 0 && about.type == H5L_TYPE_HARD;
}

Result<std::shared_ptr<HdfFile>> HdfFile::open(std::shared_ptr<const InputFile> input) {
  std::shared_ptr<HdfFile> out(new HdfFile(std::move(input)));
  const LibraryLock lock;
  auto storage = netcdf::scan_storage(*out->input_);
  if (!storage) return storage.error();
  out->storage_ = std::move(*storage);
  out->file_ = netcdf::open_hdf5(*out->input_);
  if (!out->file_) return out->input_->fault("cannot be read as HDF5: it is truncated or damaged");
  return out;
}

HdfFile::~HdfFile() {
  const LibraryLock lock;
  file_ = Handle();
}

std::vector<std::uint64_t> HdfFile::lengths(const std::string& path) const {
  const auto at = storage_.find(path);
  if (at == storage_.end()) return {};
  return {at->second.extent.begin(), at->second.extent.end()};
}

std::vector<std::string> HdfFile::datasets_in(const std::string& group) const {
  std::vector<std::string> out;
  const std::string start = group + '/';
  for (auto at = storage_.lower_bound(start); at != storage_.end(); ++at) {
    if (!at->first.starts_with(start)) break;
    const std::string name = at->first.substr(start.size());
    if (name.find('/') == std::string::npos) out.push_back(name);
  }
  return out;
}

std::vector<std::string> HdfFile::groups_in(const std::string& group) const {
  std::set<std::string> found;
  const std::string start = group + '/';
  for (auto at = storage_.lower_bound(start); at != storage_.end(); ++at) {
    if (!at->first.starts_with(start)) break;
    const std::string name = at->first.substr(start.size());
    if (const auto slash = name.find('/'); slash != std::string::npos) {
      found.insert(name.substr(0, slash));
    }
  }
  return {found.begin(), found.end()};
}

bool HdfFile::has_attribute(const std::string& group, const char* name) const {
  const LibraryLock lock;
  return H5Aexists_by_name(file_.id(), group.c_str(), name, H5P_DEFAULT) > 0;
}

std::optional<std::string> HdfFile::text(const std::string& group, const char* name) const {
  const LibraryLock lock;
  const Handle attribute(H5Aopen_by_name(file_.id(), group.c_str(), name, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  if (!attribute) return {};
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  if (!type || !space || H5Tget_class(type.id()) != H5T_STRING ||
      H5Sget_simple_extent_npoints(space.id()) != 1) {
    return {};
  }
  if (H5Tis_variable_str(type.id()) > 0) {
    char* value = nullptr;
    if (H5Aread(attribute.id(), type.id(), static_cast<void*>(&value)) < 0 || value == nullptr) {
      return {};
    }
    std::string out(value, ::strnlen(value, text_bytes_most));
    H5free_memory(value);
    return out;
  }
  const std::size_t size = H5Tget_size(type.id());
  if (size == 0 || size > text_bytes_most) return {};
  std::string out(size, '\0');
  if (H5Aread(attribute.id(), type.id(), out.data()) < 0) return {};
  out.resize(::strnlen(out.data(), size));
  while (out.ends_with(' ')) out.pop_back();
  return out;
}

std::optional<std::vector<double>> HdfFile::numbers(const std::string& group, const char* name,
                                                    std::size_t count) const {
  const LibraryLock lock;
  const Handle attribute(H5Aopen_by_name(file_.id(), group.c_str(), name, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  if (!attribute) return {};
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  if (!type || !space || !scalar_of(type.id()) ||
      H5Sget_simple_extent_npoints(space.id()) != static_cast<hssize_t>(count)) {
    return {};
  }
  std::vector<double> out(count);
  if (H5Aread(attribute.id(), H5T_NATIVE_DOUBLE, out.data()) < 0) return {};
  return out;
}

Result<StoredArray> HdfFile::array(const std::string& path, std::vector<std::uint64_t> start,
                                   std::vector<std::uint64_t> count, int components) {
  const auto fault = [&](const std::string& what) {
    return input_->fault("is malformed: the dataset " + in_quotes(path) + " " + what);
  };
  const auto at = storage_.find(path);
  if (at == storage_.end()) return fault("is missing");
  const netcdf::DatasetStorage& storage = at->second;
  if (!storage.problem.empty()) return fault("cannot be read: " + storage.problem);
  if (start.size() != storage.extent.size() || count.size() != start.size() || start.empty()) {
    return fault("has " + std::to_string(storage.extent.size()) + " dimensions");
  }
  std::uint64_t values = 1;
  for (std::size_t d = 0; d < start.size(); ++d) {
    if (start[d] > storage.extent[d] || count[d] > storage.extent[d] - start[d]) {
      return fault("has " + std::to_string(storage.extent[d]) + " items along its dimension " +
                   std::to_string(d) + ", but " + std::to_string(start[d]) + " + " +
                   std::to_string(count[d]) + " are needed");
    }
    if (count[d] > 0 && values > (std::uint64_t{1} << 48) / count[d]) return fault("is too large");
    values *= count[d];
  }
  if (values * storage.item_bytes / hdf_growth_max > input_->size()) {
    return fault("has more values than the file can hold");
  }
  const LibraryLock lock;
  const Handle dataset(H5Dopen2(file_.id(), path.c_str(), H5P_DEFAULT), H5Dclose);
  const Handle type(dataset ? H5Dget_type(dataset.id()) : -1, H5Tclose);
  const auto scalar = type ? scalar_of(type.id()) : std::nullopt;
  if (!scalar) return fault("is not of integers of 1 to 8 bytes or floats of 4 or 8 bytes");
  HdfPart part;
  part.file = shared_from_this();
  part.path = path;
  part.start = std::move(start);
  part.count = std::move(count);
  while (part.along + 1 < part.count.size() && part.count[part.along] == 1) ++part.along;
  if (!storage.chunk.empty()) part.chunk = storage.chunk[part.along];
  StoredArray out;
  out.name = path.substr(path.rfind('/') + 1);
  out.type = *scalar;
  out.components = components;
  out.tuples = values / static_cast<std::uint64_t>(components);
  out.encoding = Encoding::hdf5;
  out.hdf = std::make_shared<const HdfPart>(std::move(part));
  return out;
}

Result<std::vector<double>> HdfFile::values(const std::string& path, std::uint64_t start,
                                            std::uint64_t count) {
  if (count > listed_values_max) {
    return input_->fault("has more than " + std::to_string(listed_values_max) + " items of " +
                         in_quotes(path));
  }
  std::vector<std::uint64_t> from{start};
  std::vector<std::uint64_t> size{count};
  if (lengths(path).size() == 2) {
    from.push_back(0);
    size.push_back(1);
  }
  const auto found = array(path, from, size, 1);
  if (!found) return found.error();
  std::vector<double> out(static_cast<std::size_t>(count));
  if (count == 0) return out;
  auto done = read(*found->hdf, found->type, {from.begin(), from.end()}, {size.begin(), size.end()},
                   out.data());
  return done ? Result<std::vector<double>>(std::move(out)) : done.error();
}

template <class Out>
Result<void> HdfFile::read(const HdfPart& part, bytes::Scalar type,
                           const std::vector<std::size_t>& start,
                           const std::vector<std::size_t>& count, Out* out) {
  const auto fault = [&](const std::string& what) {
    return input_->fault("cannot be read: the dataset " + in_quotes(part.path) + " " + what);
  };
  const LibraryLock lock;
  netcdf::OpenDataset examined(file_, part.path, storage_.at(part.path), absent_[part.path]);
  const netcdf::Block block{start, count};
  if (auto fine = examined.check(block); !fine) return fault(fine.error().message);
  const Handle dataset(H5Dopen2(file_.id(), part.path.c_str(), H5P_DEFAULT), H5Dclose);
  const Handle space(dataset ? H5Dget_space(dataset.id()) : -1, H5Sclose);
  const std::vector<hsize_t> from(start.begin(), start.end());
  const std::vector<hsize_t> size(count.begin(), count.end());
  const Handle memory(H5Screate_simple(static_cast<int>(size.size()), size.data(), nullptr),
                      H5Sclose);
  const std::size_t values =
      std::accumulate(count.begin(), count.end(), std::size_t{1}, std::multiplies<>());
  const bool plain = bytes::size_of(type) == sizeof(Out) && type >= bytes::Scalar::float32;
  std::vector<unsigned char> raw(plain ? 0 : values * bytes::size_of(type));
  void* into = plain ? static_cast<void*>(out) : static_cast<void*>(raw.data());
  const bool done =
      dataset && space && memory &&
      H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, from.data(), nullptr, size.data(), nullptr) >=
          0 &&
      H5Dread(dataset.id(), memory_type(type), memory.id(), space.id(), H5P_DEFAULT, into) >= 0;
  if (!done) return fault("is truncated or damaged");
  if (!plain) {
    bytes::decode(type, std::endian::native == std::endian::big, raw.data(), bytes::size_of(type),
                  values, out);
  }
  examined.mask(block, out);
  return {};
}

template Result<void> HdfFile::read(const HdfPart& part, bytes::Scalar type,
                                    const std::vector<std::size_t>& start,
                                    const std::vector<std::size_t>& count, float* out);
template Result<void> HdfFile::read(const HdfPart& part, bytes::Scalar type,
                                    const std::vector<std::size_t>& start,
                                    const std::vector<std::size_t>& count, double* out);

}  // namespace windsplat::data::vtk
