#include "server/data/formats/dap/file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/formats/dap/das.hpp"
#include "server/data/formats/dap/dds.hpp"

namespace windsplat::data::dap {

namespace {

constexpr std::size_t description_max = std::size_t{4} << 20;
constexpr std::size_t header_max = std::size_t{64} << 10;  // DDS before the values of a variable
constexpr std::size_t window_bytes = std::size_t{64} << 10;
// Larger blocks are asked for in parts: THREDDS refuses answers of more than 500 MB by default.
constexpr std::size_t answer_bytes = std::size_t{64} << 20;

// Bytes of a number in an array: XDR has no types of one or two bytes, except arrays of bytes.
std::size_t stored_bytes_of(Type type) {
  return type == Type::uint8 ? 1 : type == Type::float64 ? 8 : 4;
}

const char* name_of(Type type) {
  switch (type) {
    case Type::uint8:
      return "uint8";
    case Type::int16:
      return "int16";
    case Type::uint16:
      return "uint16";
    case Type::int32:
      return "int32";
    case Type::uint32:
      return "uint32";
    case Type::float32:
      return "float32";
    case Type::float64:
      return "float64";
    case Type::text:
      return "text";
  }
  return "text";
}

std::uint32_t word_at(const unsigned char* bytes) {
  return static_cast<std::uint32_t>(bytes[0]) << 24U | static_cast<std::uint32_t>(bytes[1]) << 16U |
         static_cast<std::uint32_t>(bytes[2]) << 8U | bytes[3];
}

// RFC 4506: big-endian, types of two bytes as four.
double number_at(Type type, const unsigned char* bytes) {
  if (type == Type::uint8) return bytes[0];
  const std::uint32_t word = word_at(bytes);
  switch (type) {
    case Type::int16:
      return static_cast<std::int16_t>(word);
    case Type::uint16:
      return static_cast<std::uint16_t>(word);
    case Type::int32:
      return static_cast<std::int32_t>(word);
    case Type::uint32:
      return word;
    case Type::float32:
      return std::bit_cast<float>(word);
    default:
      return std::bit_cast<double>(static_cast<std::uint64_t>(word) << 32U | word_at(bytes + 4));
  }
}

Result<std::string> text_of_file(Files& files, const std::string& name) {
  const auto file = files.open(name);
  if (!file) return file.error();
  if ((*file)->size() > description_max) {
    return (*file)->fault("has more than " + std::to_string(description_max) + " bytes");
  }
  auto text = (*file)->head(description_max);
  if (!text) return text.error();
  const std::size_t begin = std::min(text->find_first_not_of(" \t\r\n"), text->size());
  if (std::string_view(*text).substr(begin).starts_with("Error")) {
    return (*file)->fault("is answered with an error of the service: " +
                          printable(text->substr(begin), 300));
  }
  if (std::string_view(*text).substr(begin).starts_with('<')) {
    return (*file)->fault(
        "is answered with a page (HTML or XML), not with a description: the service may need a "
        "login, or is none of OPeNDAP");
  }
  return text;
}

// Values of these attributes are compared with stored values.
constexpr auto stored_attributes = std::to_array<std::string_view>(
    {"_FillValue", "missing_value", "valid_min", "valid_max", "valid_range"});

// Whether bytes are signed, which DAP 2 lacks: THREDDS says so by _Unsigned (netcdf-c 1317), older
// ones only by a negative value of an attribute.
bool is_signed_byte(const Array& array, const std::map<std::string, Attributes>& attributes) {
  const auto all = attributes.find(array.name);
  if (array.type != Type::uint8 || all == attributes.end()) return false;
  const auto mark = all->second.find("_Unsigned");
  if (mark != all->second.end()) return lower(trim(mark->second.text)) == "false";
  return std::any_of(stored_attributes.begin(), stored_attributes.end(), [&](auto name) {
    const auto found = all->second.find(std::string(name));
    return found != all->second.end() &&
           std::any_of(found->second.numbers.begin(), found->second.numbers.end(),
                       [](double number) { return number < 0; });
  });
}

// A number in the range of the type: services describe netCDF's int16 with _Unsigned as UInt16, but
// leave its _FillValue -1 (netcdf-c 1614), and signed bytes as Byte.
double as_stored(Type type, bool is_signed, double number) {
  const double range = type == Type::uint8    ? 256.0
                       : type == Type::uint16 ? 65536.0
                       : type == Type::uint32 ? 4294967296.0
                                              : 0.0;
  if (is_signed) return number > 127 && number < range ? number - range : number;
  return number < 0 && number >= -range / 2 ? number + range : number;
}

// The slowest dimension of several entries of a block of more than answer_bytes; otherwise their
// number.
std::size_t dimension_to_cut(const Array& array, const std::vector<std::size_t>& count) {
  std::size_t bytes = stored_bytes_of(array.type);
  for (const std::size_t one : count) bytes *= one;
  if (bytes <= answer_bytes) return count.size();
  std::size_t d = 0;
  while (d < count.size() && count[d] < 2) ++d;
  return d;
}

class ServedFile final : public cf::ArrayFile {
 public:
  static Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files) {
    std::unique_ptr<ServedFile> out(new ServedFile(files));
    const auto dds = text_of_file(*files, out->name_ + ".dds");
    if (!dds) return dds.error();
    const auto das = text_of_file(*files, out->name_ + ".das");
    if (!das) return das.error();
    out->identity_ = *dds + '\n' + *das;
    auto described = parse_dds(*dds);
    if (!described) return out->fault(described.error().message);
    auto attributes = parse_das(*das);
    if (!attributes) return out->fault(attributes.error().message);
    out->attributes_ = std::move(*attributes);
    out->fill(std::move(*described));
    return std::unique_ptr<cf::ArrayFile>(std::move(out));
  }

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string format() const override { return "OPeNDAP (DAP2)"; }
  [[nodiscard]] std::string identity() const override { return identity_; }

  [[nodiscard]] cf::Numbers numbers(int variable, const char* attribute) const override {
    const Array& array = arrays_[cf::at(variable)];
    const Attribute* const found = find(array.name, attribute);
    if (found == nullptr) return {};
    cf::Numbers out{found->numbers, found->is_floating};
    if (!is_one_of(std::string(attribute), stored_attributes)) return out;
    const bool is_signed = is_signed_byte(array, attributes_);
    for (double& number : out.values) number = as_stored(array.type, is_signed, number);
    return out;
  }
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override {
    return text(arrays_[cf::at(variable)].name, attribute);
  }
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const override {
    return std::vector<std::size_t>(arrays_[cf::at(variable)].dims.size(), 1);
  }

  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override {
    return read_any(variable, start, count, out);
  }
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override {
    return read_any(variable, start, count, out);
  }

 private:
  explicit ServedFile(std::shared_ptr<Files> files)
      : files_(std::move(files)), name_(files_->location().members.front().name) {}

  [[nodiscard]] Error fault(const std::string& what) const {
    return make_error(ErrorKind::bad_data, in_quotes(name_) + ": " + what);
  }

  [[nodiscard]] const Attribute* find(const std::string& variable, const char* name) const {
    const auto all = attributes_.find(variable);
    if (all == attributes_.end()) return nullptr;
    const auto found = all->second.find(name);
    return found == all->second.end() ? nullptr : &found->second;
  }
  [[nodiscard]] std::string text(const std::string& variable, const char* name) const {
    const Attribute* const found = find(variable, name);
    return found == nullptr || !found->is_text ? "" : std::string(trim(found->text));
  }

  void fill(Dds dds) {
    contents_.title = text("NC_GLOBAL", "title");
    if (contents_.title.empty()) contents_.title = text("HDF5_GLOBAL", "title");
    std::map<std::string, int> known;
    arrays_ = std::move(dds.arrays);
    for (const Array& array : arrays_) {
      FileVariable variable;
      for (const Dimension& dimension : array.dims) {
        const auto [at, is_new] =
            known.emplace(dimension.name, static_cast<int>(contents_.dimensions.size()));
        if (is_new) {
          FileDimension added;
          added.name = dimension.name;
          added.length = static_cast<std::size_t>(dimension.length);
          contents_.dimensions.push_back(std::move(added));
        }
        variable.dims.push_back(at->second);
      }
      describe(array, variable);
      contents_.variables.push_back(std::move(variable));
    }
    for (const std::string& other : dds.others) {
      contents_.left_out.push_back({other, "it is a structure or a sequence of OPeNDAP"});
    }
  }

  void describe(const Array& array, FileVariable& out) const {
    const auto value = [&](const char* name) { return text(array.name, name); };
    out.name = array.name;
    out.type = is_signed_byte(array, attributes_) ? "int8" : name_of(array.type);
    out.numeric = array.type != Type::text;
    out.standard_name = value("standard_name");
    out.long_name = value("long_name");
    out.units = value("units");
    out.axis = value("axis");
    out.positive = value("positive");
    out.calendar = value("calendar");
    out.coordinates = value("coordinates");
    out.bounds = value("bounds");
    if (out.bounds.empty()) out.bounds = value("climatology");
    out.grid_mapping = value("grid_mapping");
    out.cf_role = value("cf_role");
    out.mesh = value("mesh");
    out.vector_mark = value("windsplat_vector");
    out.is_unsigned = lower(value("_Unsigned")) == "true";
    out.packed =
        find(array.name, "scale_factor") != nullptr || find(array.name, "add_offset") != nullptr;
  }

  template <class Out>
  Result<void> read_any(int variable, const std::vector<std::size_t>& start,
                        const std::vector<std::size_t>& count, Out* out) const {
    const Array& array = arrays_[cf::at(variable)];
    if (const std::size_t d = dimension_to_cut(array, count); d < count.size()) {
      return read_parts(variable, start, count, d, out);
    }
    std::string constraint = array.path;
    std::size_t values = 1;
    for (std::size_t d = 0; d < array.dims.size(); ++d) {
      if (count[d] == 0) return {};
      constraint +=
          '[' + std::to_string(start[d]) + ":1:" + std::to_string(start[d] + count[d] - 1) + ']';
      values *= count[d];
    }
    const auto file = files_->open(name_ + ".dods?" + constraint);
    if (!file) return file.error();
    const auto begin = values_begin(**file, array, count);
    if (!begin) return begin.error();
    return copy(**file, array, *begin, values, out);
  }

  // Reads both halves along dimension d. Those before have one entry, so that the first half comes
  // first.
  template <class Out>
  Result<void> read_parts(int variable, std::vector<std::size_t> start,
                          std::vector<std::size_t> count, std::size_t d, Out* out) const {
    const std::size_t all = count[d];
    count[d] = all / 2;
    if (auto done = read_any(variable, start, count, out); !done) return done;
    std::size_t values = 1;
    for (const std::size_t one : count) values *= one;
    start[d] += count[d];
    count[d] = all - count[d];
    return read_any(variable, start, count, out + values);
  }

  // The offset of the values behind the description of what was sent, which must be what was asked
  // for.
  Result<std::uint64_t> values_begin(const InputFile& file, const Array& array,
                                     const std::vector<std::size_t>& count) const {
    const auto head = file.head(header_max);
    if (!head) return head.error();
    if (std::string_view(trim(*head)).starts_with("Error")) {
      return fault("the service answers with an error: " + printable(*head, 300));
    }
    std::size_t end = head->find("\nData:\n");
    std::size_t skipped = 7;
    if (end == std::string::npos) {
      end = head->find("\nData:\r\n");
      skipped = 8;
    }
    if (end == std::string::npos)
      return fault("the values of " + in_quotes(array.name) + " have no 'Data:'");
    const auto sent = parse_sent(std::string_view(*head).substr(0, end + 1));
    if (!sent) return fault(sent.error().message);
    bool same = sent->type == array.type && sent->dims.size() == array.dims.size();
    for (std::size_t d = 0; same && d < count.size(); ++d) same = sent->dims[d].length == count[d];
    if (!same) {
      return fault("the service sends other values of " + in_quotes(array.name) +
                   " than were asked for");
    }
    std::uint64_t at = end + skipped;
    if (array.dims.empty()) return at;
    std::array<unsigned char, 8> lengths{};
    if (auto done = file.read(at, lengths.data(), lengths.size()); !done) return done.error();
    std::uint64_t values = 1;
    for (const std::size_t one : count) values *= one;
    if (word_at(lengths.data()) != values || word_at(lengths.data() + 4) != values) {
      return fault("the service sends another number of values of " + in_quotes(array.name) +
                   " than it says");
    }
    return at + lengths.size();
  }

  template <class Out>
  Result<void> copy(const InputFile& file, const Array& array, std::uint64_t at, std::size_t values,
                    Out* out) const {
    const bool is_single_byte = array.type == Type::uint8 && array.dims.empty();
    const std::size_t each = is_single_byte ? 4 : stored_bytes_of(array.type);
    const bool is_signed = is_signed_byte(array, attributes_);
    std::vector<unsigned char> window(window_bytes);
    for (std::size_t done = 0; done < values;) {
      const std::size_t some = std::min(values - done, window_bytes / each);
      if (auto came = file.read(at, window.data(), some * each); !came) return came;
      for (std::size_t i = 0; i < some; ++i) {
        const unsigned char* const bytes = window.data() + i * each + (is_single_byte ? 3 : 0);
        double value = number_at(array.type, bytes);
        if (is_signed && value > std::numeric_limits<std::int8_t>::max()) value -= 256;
        out[done + i] = static_cast<Out>(value);
      }
      at += some * each;
      done += some;
    }
    return {};
  }

  std::shared_ptr<Files> files_;
  std::string name_;
  std::string identity_;
  std::map<std::string, Attributes> attributes_;
  std::vector<Array> arrays_;  // parallel to contents_.variables
  FileContents contents_;
};

}  // namespace

Result<std::unique_ptr<cf::ArrayFile>> open(const std::shared_ptr<Files>& files) {
  return ServedFile::open(files);
}

}  // namespace windsplat::data::dap
