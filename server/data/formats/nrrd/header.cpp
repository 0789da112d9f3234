// Lines -> fields -> Header. `dimension` must be first in the format and is processed first.
#include "server/data/formats/nrrd/header.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"

namespace windsplat::data::nrrd {

namespace {

constexpr std::size_t header_max = std::size_t{4} << 20;
constexpr std::size_t data_files_max = 100'000;
constexpr std::int64_t dimension_max = 16;  // NRRD_DIM_MAX

struct Line {
  std::size_t number;
  std::string_view key;  // as written
  std::string_view value;
};

struct TypeName {
  std::string_view name;
  bytes::Scalar type;
};
constexpr auto type_names = std::to_array<TypeName>({
    {"signed char", bytes::Scalar::int8},
    {"int8", bytes::Scalar::int8},
    {"int8_t", bytes::Scalar::int8},
    {"uchar", bytes::Scalar::uint8},
    {"unsigned char", bytes::Scalar::uint8},
    {"uint8", bytes::Scalar::uint8},
    {"uint8_t", bytes::Scalar::uint8},
    {"short", bytes::Scalar::int16},
    {"short int", bytes::Scalar::int16},
    {"signed short", bytes::Scalar::int16},
    {"signed short int", bytes::Scalar::int16},
    {"int16", bytes::Scalar::int16},
    {"int16_t", bytes::Scalar::int16},
    {"ushort", bytes::Scalar::uint16},
    {"unsigned short", bytes::Scalar::uint16},
    {"unsigned short int", bytes::Scalar::uint16},
    {"uint16", bytes::Scalar::uint16},
    {"uint16_t", bytes::Scalar::uint16},
    {"int", bytes::Scalar::int32},
    {"signed int", bytes::Scalar::int32},
    {"int32", bytes::Scalar::int32},
    {"int32_t", bytes::Scalar::int32},
    {"uint", bytes::Scalar::uint32},
    {"unsigned int", bytes::Scalar::uint32},
    {"uint32", bytes::Scalar::uint32},
    {"uint32_t", bytes::Scalar::uint32},
    {"longlong", bytes::Scalar::int64},
    {"long long", bytes::Scalar::int64},
    {"long long int", bytes::Scalar::int64},
    {"signed long long", bytes::Scalar::int64},
    {"signed long long int", bytes::Scalar::int64},
    {"int64", bytes::Scalar::int64},
    {"int64_t", bytes::Scalar::int64},
    {"ulonglong", bytes::Scalar::uint64},
    {"unsigned long long", bytes::Scalar::uint64},
    {"unsigned long long int", bytes::Scalar::uint64},
    {"uint64", bytes::Scalar::uint64},
    {"uint64_t", bytes::Scalar::uint64},
    {"float", bytes::Scalar::float32},
    {"double", bytes::Scalar::float64},
});

// Fields without effect on positions and values of samples.
constexpr auto ignored_fields = std::to_array<std::string_view>(
    {"number", "min", "max", "old min", "oldmin", "old max", "oldmax", "thicknesses"});

bool is_data_file(const Line& line) {
  const std::string key = lower(line.key);
  return key == "data file" || key == "datafile";
}

class Parser {
 public:
  explicit Parser(const InputFile& file) : file_(file) {}

  Result<Header> parse() {
    auto text = file_.head(header_max);
    if (!text) return text.error();
    split(*text);
    const Line* dimension = find("dimension");
    if (problem_.empty() && dimension == nullptr) problem_ = "has no field 'dimension'";
    if (problem_.empty()) {
      const auto count = bytes::to_integer(dimension->value);
      if (!count || *count < 1 || *count > dimension_max) {
        complain(*dimension, "the dimension must be 1 to " + std::to_string(dimension_max));
      } else {
        header_.axes.resize(static_cast<std::size_t>(*count));
      }
    }
    if (problem_.empty()) apply_lines();
    if (!problem_.empty()) return file_.fault(problem_);
    return std::move(header_);
  }

 private:
  void complain(const Line& line, const std::string& what) {
    if (!problem_.empty()) return;
    problem_ = "is not a valid NRRD file: line " + std::to_string(line.number) + " (";
    problem_ += printable(line.key, 40);
    problem_ += "): " + what;
  }

  void split(std::string_view text) {
    std::size_t at = 0;
    for (std::size_t number = 1; at < text.size(); ++number) {
      const std::size_t end = text.find('\n', at);
      const bool cut = end == std::string_view::npos;
      const std::string_view raw = text.substr(at, cut ? end : end - at);
      at = cut ? text.size() : end + 1;
      if (cut && file_.size() > text.size()) {
        problem_ = "has a header of more than " + std::to_string(header_max) + " bytes";
        return;
      }
      const std::string_view line = trim(raw);
      if (number == 1) continue;  // the magic
      if (listing_ && !line.empty()) {
        add_file({number, "data file", line}, std::string(line));
        continue;
      }
      if (line.empty()) break;
      if (line.front() == '#') continue;
      const std::size_t colon = line.find(':');
      if (colon == std::string_view::npos) {
        complain({number, "", line}, "neither a field nor a comment");
        return;
      }
      if (colon + 1 < line.size() && line[colon + 1] == '=')
        continue;  // a key/value pair defined by the user
      lines_.push_back({number, line.substr(0, colon), trim(line.substr(colon + 1))});
      const Line& last = lines_.back();
      if (is_data_file(last) && last.value.starts_with("LIST")) list(last);
    }
    header_.end = at;
  }

  void list(const Line& line) {
    listing_ = true;
    const auto words = bytes::words_of(line.value);
    if (words.size() > 1) file_dimension(line, words[1]);
  }

  void file_dimension(const Line& line, std::string_view word) {
    const auto count = bytes::to_integer(word);
    if (!count || *count < 1 || *count > dimension_max) {
      complain(line, "the dimension of a data file must be 1 to " + std::to_string(dimension_max));
    } else {
      header_.file_dimension = static_cast<std::size_t>(*count);
    }
  }

  void add_file(const Line& line, std::string name) {
    if (header_.data_files.size() >= data_files_max) {
      complain(line, "more than " + std::to_string(data_files_max) + " data files");
    } else {
      header_.data_files.push_back(std::move(name));
    }
  }

  const Line* find(std::string_view key) const {
    const auto at = std::find_if(lines_.begin(), lines_.end(),
                                 [key](const Line& line) { return lower(line.key) == key; });
    return at == lines_.end() ? nullptr : &*at;
  }

  void apply_lines() {
    for (const Line& line : lines_) {
      const std::string key = lower(line.key);
      if (!apply_axes(key, line) && !apply_space(key, line) && !apply_data(key, line) &&
          key != "dimension" &&
          std::find(ignored_fields.begin(), ignored_fields.end(), key) == ignored_fields.end()) {
        header_.notes.push_back("the header's field " + in_quotes(line.key) + " is not used");
      }
    }
    for (const char* needed : {"sizes", "type", "encoding"}) {
      if (problem_.empty() && find(needed) == nullptr) {
        problem_ = std::string("has no field '") + needed + "'";
      }
    }
    if (problem_.empty() && bytes::size_of(header_.type) > 1 && find("endian") == nullptr &&
        (header_.encoding == "raw" || header_.encoding == "gzip" || header_.encoding == "hex")) {
      problem_ = "has no field 'endian', and its numbers have more than one byte";
    }
  }

  // Splits a line into one word per axis.
  std::vector<std::string_view> one_each(const Line& line) {
    auto words = bytes::words_of(line.value);
    if (words.size() != header_.axes.size()) {
      complain(line, std::to_string(words.size()) + " entries for " +
                         std::to_string(header_.axes.size()) + " axes");
      words.resize(header_.axes.size());
    }
    return words;
  }

  void numbers_each(const Line& line, double HeaderAxis::*member) {
    const auto words = one_each(line);
    for (std::size_t a = 0; a < words.size(); ++a) {
      const auto value = bytes::to_double(words[a]);
      if (!value || std::isinf(*value)) complain(line, in_quotes(words[a]) + " is not a number");
      header_.axes[a].*member = value.value_or(not_given);
    }
  }

  // "one" "two", with \" within.
  std::vector<std::string> quoted(const Line& line) {
    std::vector<std::string> out;
    std::string_view rest = line.value;
    while (!(rest = trim(rest)).empty()) {
      if (rest.front() != '"') {
        complain(line, "text must be in double quotes");
        return out;
      }
      std::string text;
      std::size_t at = 1;
      for (; at < rest.size() && rest[at] != '"'; ++at) {
        if (rest[at] == '\\' && at + 1 < rest.size()) ++at;
        text += rest[at];
      }
      if (at >= rest.size()) {
        complain(line, "a double quote is missing");
        return out;
      }
      out.emplace_back(trim(text));
      rest.remove_prefix(at + 1);
    }
    return out;
  }

  void quoted_each(const Line& line, std::string HeaderAxis::*member) {
    auto texts = quoted(line);
    if (texts.size() != header_.axes.size()) {
      complain(line, std::to_string(texts.size()) + " entries for " +
                         std::to_string(header_.axes.size()) + " axes");
      return;
    }
    for (std::size_t a = 0; a < texts.size(); ++a) header_.axes[a].*member = std::move(texts[a]);
  }

  bool apply_axes(const std::string& key, const Line& line) {
    if (key == "sizes") {
      const auto words = one_each(line);
      for (std::size_t a = 0; a < words.size(); ++a) {
        const auto size = bytes::to_integer(words[a]);
        if (!size || *size < 1) complain(line, in_quotes(words[a]) + " is not a size");
        header_.axes[a].size =
            static_cast<std::uint64_t>(std::max<std::int64_t>(1, size.value_or(1)));
      }
    } else if (key == "spacings") {
      numbers_each(line, &HeaderAxis::spacing);
    } else if (key == "axis mins" || key == "axismins") {
      numbers_each(line, &HeaderAxis::min);
    } else if (key == "axis maxs" || key == "axismaxs") {
      numbers_each(line, &HeaderAxis::max);
    } else if (key == "centers" || key == "centerings") {
      const auto words = one_each(line);
      for (std::size_t a = 0; a < words.size(); ++a) {
        const std::string word = lower(words[a]);
        if (word != "cell" && word != "node" && word != "none" && word != "???") {
          complain(line, in_quotes(words[a]) + " is neither cell nor node");
        }
        header_.axes[a].node_centered = word == "node";
      }
    } else if (key == "kinds") {
      const auto words = one_each(line);
      for (std::size_t a = 0; a < words.size(); ++a) {
        const std::string word = lower(words[a]);
        header_.axes[a].kind = word == "none" || word == "???" ? "" : word;
      }
    } else if (key == "labels") {
      quoted_each(line, &HeaderAxis::label);
    } else if (key == "units") {
      quoted_each(line, &HeaderAxis::units);
    } else {
      return false;
    }
    return true;
  }

  // "(1,0,0) none (0,1,0)": nullopt if malformed.
  std::optional<std::vector<std::vector<double>>> vectors(std::string_view text) {
    std::vector<std::vector<double>> out;
    while (!(text = trim(text)).empty()) {
      if (text.starts_with("none")) {
        out.emplace_back();
        text.remove_prefix(4);
        continue;
      }
      const std::size_t end = text.find(')');
      if (text.front() != '(' || end == std::string_view::npos) return std::nullopt;
      std::vector<double> vector;
      std::string inside(text.substr(1, end - 1));
      for (std::size_t from = 0; from <= inside.size();) {
        const std::size_t comma = std::min(inside.find(',', from), inside.size());
        const auto value = bytes::to_double(trim(inside.substr(from, comma - from)));
        if (!value || !std::isfinite(*value)) return std::nullopt;
        vector.push_back(*value);
        from = comma + 1;
      }
      out.push_back(std::move(vector));
      text.remove_prefix(end + 1);
    }
    return out;
  }

  bool apply_space(const std::string& key, const Line& line) {
    if (key == "space") {
      header_.space = lower(line.value);
    } else if (key == "space dimension") {
      const auto count = bytes::to_integer(line.value);
      if (!count || *count < 1 || *count > 8) complain(line, "must be 1 to 8");
      header_.space_dimension = static_cast<std::size_t>(count.value_or(0));
    } else if (key == "space directions") {
      const auto found = vectors(line.value);
      if (!found || found->size() != header_.axes.size()) {
        complain(line, "one vector of finite numbers, or 'none', is needed for each axis");
        return true;
      }
      for (std::size_t a = 0; a < found->size(); ++a) header_.axes[a].direction = (*found)[a];
    } else if (key == "space origin") {
      const auto found = vectors(line.value);
      if (!found || found->size() != 1)
        complain(line, "one vector of finite numbers is needed");
      else
        header_.origin = found->front();
    } else if (key == "space units") {
      header_.space_units = quoted(line);
    } else if (key == "measurement frame") {
      header_.measurement_frame = true;
    } else {
      return false;
    }
    return true;
  }

  void set_type(const Line& line) {
    const std::string name = lower(line.value);
    const auto* at = std::find_if(type_names.begin(), type_names.end(),
                                  [&](const TypeName& known) { return known.name == name; });
    if (at != type_names.end()) {
      header_.type = at->type;
    } else if (name == "block") {
      complain(line, "elements of type block are not numbers");
    } else {
      complain(line, in_quotes(name) + " is not a NRRD type");
    }
  }

  void set_encoding(const Line& line) {
    const std::string name = lower(line.value);
    if (name == "raw" || name == "hex") {
      header_.encoding = name;
    } else if (name == "ascii" || name == "text" || name == "txt") {
      header_.encoding = "text";
    } else if (name == "gzip" || name == "gz") {
      header_.encoding = "gzip";
    } else if (name == "bzip2" || name == "bz2") {
      complain(line, "bzip2 is not supported; save it with encoding gzip or raw");
    } else {
      complain(line, in_quotes(name) + " is not a NRRD encoding");
    }
  }

  bool apply_data(const std::string& key, const Line& line) {
    if (key == "type") {
      set_type(line);
    } else if (key == "encoding") {
      set_encoding(line);
    } else if (key == "endian") {
      const std::string name = lower(line.value);
      if (name != "little" && name != "big") complain(line, "must be little or big");
      header_.big_endian = name == "big";
    } else if (key == "content") {
      header_.content = line.value;
    } else if (key == "sample units" || key == "sampleunits") {
      const auto texts = line.value.starts_with('"') ? quoted(line) : std::vector<std::string>{};
      header_.sample_units = texts.empty() ? std::string(line.value) : texts.front();
    } else if (key == "line skip" || key == "lineskip") {
      header_.line_skip = skip(line, 0);
    } else if (key == "byte skip" || key == "byteskip") {
      header_.byte_skip = skip(line, -1);
    } else if (is_data_file(line)) {
      if (!listing_) set_data_file(line);
    } else {
      return false;
    }
    return true;
  }

  std::int64_t skip(const Line& line, std::int64_t least) {
    const auto count = bytes::to_integer(line.value);
    if (!count || *count < least) complain(line, "must be a number from " + std::to_string(least));
    return count.value_or(0);
  }

  // The value is one file name, or a pattern with the first number, the last and the step.
  void set_data_file(const Line& line) {
    const auto words = bytes::words_of(line.value);
    const bool pattern =
        words.size() >= 4 && words.size() <= 5 && words[0].find('%') != std::string_view::npos;
    if (!pattern) {
      add_file(line, std::string(line.value));
      return;
    }
    const auto first = bytes::to_integer(words[1]);
    const auto last = bytes::to_integer(words[2]);
    const auto step = bytes::to_integer(words[3]);
    constexpr std::int64_t far = 1'000'000'000'000;
    if (!first || !last || !step || *step == 0 || std::abs(*first) > far || std::abs(*last) > far ||
        std::abs(*step) > far || !bytes::numbered_name(words[0], 0)) {
      complain(line, "a pattern with one %d and its first number, last number and step is needed");
      return;
    }
    for (std::int64_t n = *first; problem_.empty() && (*step > 0 ? n <= *last : n >= *last);
         n += *step) {
      add_file(line, *bytes::numbered_name(words[0], n));
    }
    if (header_.data_files.empty())
      complain(line, "the range from the first to the last number is empty");
    if (words.size() == 5) file_dimension(line, words[4]);
  }

  const InputFile& file_;
  Header header_;
  std::vector<Line> lines_;
  bool listing_ = false;
  std::string problem_;
};

}  // namespace

Result<Header> parse_header(const InputFile& file) { return Parser(file).parse(); }

}  // namespace windsplat::data::nrrd
