// Parses dimensions, attributes and variables of the classic header; every count is checked against
// the size of the file before use.
#include "server/data/formats/netcdf/classic_header.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

namespace windsplat::data::netcdf {

namespace {

constexpr std::uint64_t saturated = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint64_t dimension_tag = 0x0A;
constexpr std::uint64_t variable_tag = 0x0B;
constexpr std::uint64_t attribute_tag = 0x0C;
constexpr std::uint64_t rank_max = 1024;

// Saturating sums and products.
std::uint64_t add(std::uint64_t a, std::uint64_t b) {
  return a > saturated - b ? saturated : a + b;
}
std::uint64_t multiply(std::uint64_t a, std::uint64_t b) {
  return b != 0 && a > saturated / b ? saturated : a * b;
}
std::uint64_t padded(std::uint64_t bytes) { return add(bytes, 3) / 4 * 4; }

// Bytes of one value of an external type; 0 for unknown types.
std::uint64_t type_bytes(std::uint64_t type, int version) {
  constexpr std::array<std::uint64_t, 12> type_bytes{0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
  const std::uint64_t last = version == 5 ? 11 : 6;
  return type <= last ? type_bytes.at(type) : 0;
}

struct VariableExtent {
  bool is_record = false;
  std::uint64_t bytes = 0;  // size of the variable, or of one of its records; without padding
  std::uint64_t begin = 0;
};

class Header {
 public:
  Header(const ReadBytes& read, std::uint64_t file_bytes) : read_(read), file_bytes_(file_bytes) {}

  Result<std::uint64_t> expected() {
    std::array<unsigned char, 4> magic{};
    if (!read_(0, magic.size(), magic.data())) {
      return broken("is shorter than a file signature");
    }
    version_ = magic[3];
    position_ = magic.size();
    const std::uint64_t records = count();
    const std::uint64_t streaming = version_ == 5 ? saturated : 0xFFFFFFFFU;
    dimensions();
    attributes();
    variables();
    if (!fault_.empty()) {
      return broken(fault_);
    }
    if (records == streaming) {
      return broken(
          "does not state its number of records (written as a stream), which is not supported");
    }
    return end_of_data(records);
  }

 private:
  static Error broken(const std::string& what) {
    return make_error(ErrorKind::bad_data, "the netCDF header " + what);
  }

  void fail(const char* what) {
    if (fault_.empty()) {
      fault_ = what;
    }
  }

  std::uint64_t integer(std::size_t bytes) {
    std::array<unsigned char, 8> raw{};
    if (!fault_.empty() || position_ > file_bytes_ || file_bytes_ - position_ < bytes ||
        !read_(position_, bytes, raw.data())) {
      fail("runs past the end of the file");
      return 0;
    }
    position_ += bytes;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
      value = value << 8 | raw.at(i);
    }
    return value;
  }
  std::uint64_t word() { return integer(4); }
  std::uint64_t count() { return integer(version_ == 5 ? 8 : 4); }

  void skip(std::uint64_t bytes) {
    position_ = add(position_, bytes);
    if (position_ > file_bytes_) {
      fail("runs past the end of the file");
    }
  }
  void skip_name() { skip(padded(count())); }

  // Reads the tag and length of a list whose elements have at least `element_bytes` each.
  std::uint64_t list(std::uint64_t tag, std::uint64_t element_bytes) {
    const std::uint64_t found = word();
    const std::uint64_t elements = count();
    if (found != tag && !(found == 0 && elements == 0)) {
      fail("has a list of an unknown kind");
    }
    if (multiply(elements, element_bytes) > file_bytes_) {
      fail("has a list longer than the file");
    }
    return fault_.empty() ? elements : 0;
  }

  void dimensions() {
    const std::uint64_t n = list(dimension_tag, 8);
    for (std::uint64_t i = 0; i < n && fault_.empty(); ++i) {
      skip_name();
      lengths_.push_back(count());
    }
  }

  void attributes() {
    const std::uint64_t n = list(attribute_tag, 12);
    for (std::uint64_t i = 0; i < n && fault_.empty(); ++i) {
      skip_name();
      const std::uint64_t size = type_bytes(word(), version_);
      if (size == 0) {
        fail("has an attribute of an unknown type");
      }
      skip(padded(multiply(count(), size)));
    }
  }

  void variables() {
    const std::uint64_t n = list(variable_tag, 28);
    for (std::uint64_t i = 0; i < n && fault_.empty(); ++i) {
      variable();
    }
  }

  void variable() {
    skip_name();
    const std::uint64_t rank = count();
    if (rank > rank_max) {
      fail("has a variable of more than 1024 dimensions");
      return;
    }
    VariableExtent extent;
    extent.bytes = 1;
    for (std::uint64_t d = 0; d < rank && fault_.empty(); ++d) {
      const std::uint64_t id = count();
      if (id >= lengths_.size()) {
        fail("has a variable on a dimension that does not exist");
        return;
      }
      if (lengths_[id] == 0 && d == 0) {  // length 0 marks the record dimension
        extent.is_record = true;
      } else {
        extent.bytes = multiply(extent.bytes, lengths_[id]);
      }
    }
    attributes();
    const std::uint64_t size = type_bytes(word(), version_);
    if (size == 0) {
      fail("has a variable of an unknown type");
    }
    extent.bytes = multiply(extent.bytes, size);
    count();  // vsize: redundant, and wrong by design for variables beyond 4 GiB
    extent.begin = integer(version_ == 1 ? 4 : 8);
    extents_.push_back(extent);
  }

  [[nodiscard]] std::uint64_t end_of_data(std::uint64_t records) const {
    // Records of all record variables are interleaved; a single record variable is not padded.
    std::uint64_t record_bytes = 0;
    std::size_t record_variables = 0;
    for (const VariableExtent& extent : extents_) {
      if (extent.is_record) {
        record_bytes = add(record_bytes, padded(extent.bytes));
        ++record_variables;
      }
    }
    std::uint64_t end = position_;
    for (const VariableExtent& extent : extents_) {
      if (!extent.is_record) {
        end = std::max(end, extent.bytes == 0 ? 0 : add(extent.begin, extent.bytes));
      } else if (records > 0) {
        const std::uint64_t stride = record_variables == 1 ? extent.bytes : record_bytes;
        end = std::max(end, add(add(extent.begin, multiply(records - 1, stride)), extent.bytes));
      }
    }
    return end;
  }

  const ReadBytes& read_;
  std::uint64_t file_bytes_;
  std::uint64_t position_ = 0;
  int version_ = 1;
  std::string fault_;
  std::vector<std::uint64_t> lengths_;
  std::vector<VariableExtent> extents_;
};

}  // namespace

Result<std::uint64_t> classic_bytes_expected(const ReadBytes& read, std::uint64_t file_bytes) {
  return Header(read, file_bytes).expected();
}

}  // namespace windsplat::data::netcdf
