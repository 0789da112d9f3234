// Parses records by their first word, with the rules of GrADS: any case, lists over several lines.
#include "server/data/formats/grads/descriptor.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"
#include "server/data/formats/grads/gauss.hpp"

namespace windsplat::data::grads {

namespace {

constexpr std::size_t descriptor_max = std::size_t{1} << 20;
constexpr std::int64_t axis_max = std::int64_t{1} << 24;
constexpr std::int64_t times_max = 10'000'000;
constexpr std::size_t variables_max = 8192;
constexpr std::int64_t header_max = std::int64_t{1} << 40;

// Names of Gaussian axes, and their numbers of latitudes from pole to pole.
struct Gaussian {
  std::string_view name;
  int latitudes;
};
constexpr auto gaussians = std::to_array<Gaussian>({{"gaust62", 94},
                                                    {"gaust106", 160},
                                                    {"gausr15", 40},
                                                    {"gausr20", 52},
                                                    {"gausr30", 80},
                                                    {"gausr40", 102}});

// Units at the end of a description: "wind [m/s]", "heat flux (cal/cm**2/s)". A number in
// parentheses is a height instead: "wind (10 m)".
std::string units_in(std::string_view description) {
  if (description.empty()) return {};
  const bool brackets = description.back() == ']';
  if (!brackets && description.back() != ')') return {};
  const std::size_t from = description.rfind(brackets ? '[' : '(');
  if (from == std::string_view::npos) return {};
  const auto inside = trim(description.substr(from + 1, description.size() - from - 2));
  const bool place = !inside.empty() && inside.front() >= '0' && inside.front() <= '9';
  return !brackets && place ? std::string() : std::string(inside);
}

struct Line {
  std::size_t number;
  std::string_view text;
  std::vector<std::string_view> words;
  std::string key;
};

std::string rest(const Line& line, std::size_t words) {
  if (line.words.size() <= words) return {};
  return std::string(
      line.text.substr(static_cast<std::size_t>(line.words[words].data() - line.text.data())));
}

class Parser {
 public:
  explicit Parser(const InputFile& file) : file_(file) {}

  Result<Descriptor> parse() {
    if (file_.size() > descriptor_max) {
      return file_.fault("is too large for a GrADS descriptor: more than " +
                         std::to_string(descriptor_max) + " bytes");
    }
    auto text = file_.head(descriptor_max);
    if (!text) return text.error();
    split(*text);
    out_.big_endian = std::endian::native == std::endian::big;
    while (problem_.empty() && at_ < lines_.size()) apply(lines_[at_++]);
    if (problem_.empty()) finish();
    if (!problem_.empty()) return file_.fault(problem_);
    return std::move(out_);
  }

 private:
  void complain(const Line& line, const std::string& what) {
    if (!problem_.empty()) return;
    problem_ = "is invalid: line " + std::to_string(line.number) + " (";
    problem_ += printable(line.key, 40);
    problem_ += "): " + what;
  }

  void split(std::string_view text) {
    for (std::size_t number = 1; !text.empty(); ++number) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      const std::string_view line = trim(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
      if (line.empty() || line.front() == '*') continue;
      Line entry{number, line, bytes::words_of(line), {}};
      entry.key = lower(entry.words.front());
      lines_.push_back(std::move(entry));
    }
  }

  // The rest of a line after the first `words` words.
  std::int64_t integer(const Line& line, std::size_t word, std::int64_t least, std::int64_t most) {
    if (line.words.size() > word) {
      const auto value = bytes::to_integer(line.words[word]);
      if (value && *value >= least && *value <= most) return *value;
    }
    complain(line, "word " + std::to_string(word + 1) + " must be a number from " +
                       std::to_string(least) + " to " + std::to_string(most));
    return least;
  }

  double number(const Line& line, std::size_t word) {
    if (line.words.size() > word) {
      const auto value = bytes::to_double(line.words[word]);
      if (value && std::isfinite(*value)) return *value;
    }
    complain(line, "word " + std::to_string(word + 1) + " must be a finite number");
    return 0;
  }

  void apply(const Line& line) {
    if (line.key == "dset") {
      set_dset(line);
    } else if (line.key == "title") {
      out_.title = rest(line, 1);
    } else if (line.key == "undef") {
      out_.undef = number(line, 1);
      out_.has_undef = true;
    } else if (line.key == "options" || line.key == "format") {
      set_options(line);
    } else if (line.key == "xdef") {
      out_.x = axis(line);
    } else if (line.key == "ydef") {
      out_.y = axis(line);
    } else if (line.key == "zdef") {
      out_.z = axis(line);
    } else if (line.key == "tdef") {
      set_times(line);
    } else if (line.key == "vars") {
      set_variables(line);
    } else if (line.key == "@") {
      set_attribute(line);
    } else if (!apply_layout(line)) {
      refuse(line);
    }
  }

  bool apply_layout(const Line& line) {
    const auto set = [&](std::uint64_t& bytes) {
      bytes = static_cast<std::uint64_t>(integer(line, 1, 0, header_max));
      return true;
    };
    if (line.key == "fileheader") return set(out_.file_header);
    if (line.key == "theader" || line.key == "headerbytes") return set(out_.time_header);
    if (line.key == "trailerbytes") return set(out_.time_trailer);
    if (line.key == "xyheader") return set(out_.grid_header);
    if (line.key == "xytrailer") return set(out_.grid_trailer);
    return false;
  }

  void refuse(const Line& line) {
    if (line.key == "dtype") {
      complain(line, "data of type " + in_quotes(rest(line, 1)) +
                         " are not raw numbers; name that file itself, not its descriptor");
    } else if (line.key == "pdef") {
      complain(line, "a grid on a map projection is not supported");
    } else if (line.key == "edef") {
      if (integer(line, 1, 1, axis_max) != 1) complain(line, "an ensemble is not supported");
    } else if (line.key == "stnmap" || line.key == "chsub" || line.key == "unpack") {
      complain(line, line.key + " is not supported");
    } else if (line.key != "vectorpairs" && line.key != "cachesize" && line.key != "endvars" &&
               line.key != "index") {
      out_.notes.push_back("line " + std::to_string(line.number) + " of the descriptor (" +
                           printable(line.key, 40) + ") is unknown and ignored");
    }
  }

  void set_dset(const Line& line) {
    out_.dset = rest(line, 1);
    if (out_.dset.starts_with('^')) out_.dset.erase(0, 1);
    if (out_.dset.empty()) complain(line, "the data file's name is missing");
  }

  void set_options(const Line& line) {
    for (std::size_t w = 1; w < line.words.size(); ++w) {
      const std::string word = lower(line.words[w]);
      if (word == "yrev") {
        out_.yrev = true;
      } else if (word == "zrev") {
        out_.zrev = true;
      } else if (word == "big_endian") {
        out_.big_endian = true;
      } else if (word == "little_endian") {
        out_.big_endian = false;
      } else if (word == "byteswapped") {
        out_.big_endian = std::endian::native == std::endian::little;
      } else if (word == "sequential") {
        out_.sequential = true;
      } else if (word == "template") {
        out_.is_template = true;
      } else if (word == "365_day_calendar") {
        out_.clock.no_leap = true;
      } else if (word == "pascals") {
        out_.pascals = true;
      } else {
        complain(line, "the option " + in_quotes(word) + " is not supported");
      }
    }
  }

  bytes::Spaced axis(const Line& line) {
    bytes::Spaced out;
    out.count = static_cast<std::size_t>(integer(line, 1, 1, axis_max));
    const std::string mapping = line.words.size() > 2 ? lower(line.words[2]) : "";
    if (!problem_.empty()) return out;
    if (mapping == "linear") {
      out.first = number(line, 3);
      out.step = number(line, 4);
      if (out.count > 1 && out.step == 0) complain(line, "the increment is 0");
    } else if (mapping == "levels") {
      out.listed = levels(line, out.count);
    } else {
      out.listed = gaussian(line, out.count, mapping);
    }
    return out;
  }

  // Reads `count` numbers from this line and the following ones.
  std::vector<double> levels(const Line& line, std::size_t count) {
    std::vector<double> out;
    std::vector<std::string_view> words(line.words.begin() + 3, line.words.end());
    for (;;) {
      for (const std::string_view word : words) {
        const auto value = bytes::to_double(word);
        if (!value || !std::isfinite(*value) || out.size() == count) {
          complain(line, in_quotes(word) + " is not one of " + std::to_string(count) + " levels");
          return out;
        }
        out.push_back(*value);
      }
      if (out.size() == count) return out;
      if (at_ == lines_.size()) {
        complain(line, "there are " + std::to_string(out.size()) + " of " + std::to_string(count) +
                           " levels");
        return out;
      }
      words = lines_[at_++].words;
    }
  }

  std::vector<double> gaussian(const Line& line, std::size_t count, const std::string& mapping) {
    const auto* at = std::find_if(gaussians.begin(), gaussians.end(),
                                  [&](const Gaussian& known) { return known.name == mapping; });
    if (at == gaussians.end()) {
      complain(line, "the mapping " + in_quotes(mapping) +
                         " is none of linear, levels, gaust62, gaust106, gausr15, gausr20, "
                         "gausr30 and gausr40");
      return {};
    }
    const auto first = static_cast<std::size_t>(integer(line, 3, 1, at->latitudes));
    const std::vector<double> all = gaussian_latitudes(at->latitudes);
    if (!problem_.empty() || first - 1 + count > all.size()) {
      complain(line, "there are " + std::to_string(all.size()) + " such latitudes");
      return {};
    }
    const auto from = all.begin() + static_cast<std::ptrdiff_t>(first - 1);
    return {from, from + static_cast<std::ptrdiff_t>(count)};
  }

  void set_times(const Line& line) {
    out_.times = static_cast<std::size_t>(integer(line, 1, 1, times_max));
    if (!problem_.empty()) return;
    if (line.words.size() < 5 || lower(line.words[2]) != "linear") {
      complain(line, "'linear', an initial time and an increment are needed");
      return;
    }
    const auto first = parse_date(line.words[3]);
    if (!first) {
      complain(line, in_quotes(line.words[3]) + " is not a time such as 00Z02JAN1987");
    } else if (!parse_increment(line.words[4], out_.clock)) {
      complain(line, in_quotes(line.words[4]) + " is not an increment such as 6hr");
    } else {
      out_.clock.first = *first;
    }
  }

  void set_variables(const Line& line) {
    const auto count =
        static_cast<std::size_t>(integer(line, 1, 1, static_cast<std::int64_t>(variables_max)));
    while (problem_.empty() && out_.variables.size() < count) {
      if (at_ == lines_.size() || lines_[at_].key == "endvars") {
        complain(line, "there are " + std::to_string(out_.variables.size()) + " of " +
                           std::to_string(count) + " variables");
        return;
      }
      add_variable(lines_[at_++]);
    }
  }

  void add_variable(const Line& line) {
    if (line.key == "@") return set_attribute(line);
    Variable variable;
    const std::string name(line.words[0]);
    const std::size_t alias = name.find("=>");
    variable.name = alias == std::string::npos ? name : name.substr(alias + 2);
    if (line.words.size() < 3) {
      complain(line, "a variable requires a name, levels and units");
      return;
    }
    const std::string_view levels = line.words[1].substr(0, line.words[1].find(','));
    const auto count = bytes::to_integer(levels);
    if (!count || *count < 0 || *count > axis_max) {
      complain(line, in_quotes(levels) + " is not a number of levels");
      return;
    }
    variable.levels = static_cast<std::size_t>(*count);
    variable.description = rest(line, 3);
    variable.units = units_in(variable.description);
    set_structure(line, variable);
    const bool twice = std::any_of(out_.variables.begin(), out_.variables.end(),
                                   [&](const Variable& v) { return v.name == variable.name; });
    if (twice || variable.name.empty()) complain(line, "the name is empty or occurs twice");
    out_.variables.push_back(std::move(variable));
  }

  // "-1,20", "-1,40,2,-1": layout and type of the numbers. Other codes do not apply to raw data.
  void set_structure(const Line& line, Variable& variable) {
    std::vector<std::int64_t> numbers;
    std::string_view text = line.words[2];
    while (!text.empty()) {
      const std::size_t comma = std::min(text.find(','), text.size());
      numbers.push_back(bytes::to_integer(text.substr(0, comma)).value_or(99));
      text.remove_prefix(std::min(comma + 1, text.size()));
    }
    if (numbers.size() < 2 || numbers[0] != -1) return;
    if (numbers[1] == 20) {
      variable.times_inside = true;
    } else if (numbers[1] == 30) {
      variable.transposed = true;
    } else if (numbers[1] == 40) {
      const std::int64_t kind = numbers.size() > 2 ? numbers[2] : 0;
      const bool is_signed = kind < 0 || (numbers.size() > 3 && numbers[3] == -1);
      if (kind == 1 || kind == -1) {
        variable.type = is_signed ? bytes::Scalar::int8 : bytes::Scalar::uint8;
      } else if (kind == 2 || kind == -2) {
        variable.type = is_signed ? bytes::Scalar::int16 : bytes::Scalar::uint16;
      } else if (kind == 4) {
        variable.type = bytes::Scalar::int32;
      } else {
        complain(line, "of whole numbers -1,40,1, -1,40,2, -1,40,-2 and -1,40,4 are known");
      }
    } else {
      complain(line, "the order of data " + in_quotes(line.words[2]) + " is not supported");
    }
  }

  // "@ u String units m/s"
  void set_attribute(const Line& line) {
    if (line.words.size() < 5 || lower(line.words[3]) != "units") return;
    attributes_.emplace_back(line.words[1], rest(line, 4));
  }

  void finish() {
    if (out_.dset.empty()) problem_ = "has no record dset";
    if (out_.variables.empty()) problem_ = "has no record vars";
    if (out_.x.count == 0 || out_.y.count == 0 || out_.z.count == 0 || out_.times == 0) {
      problem_ = "lacks one of the records xdef, ydef, zdef and tdef";
    }
    for (Variable& variable : out_.variables) {
      for (const auto& [name, units] : attributes_) {
        if (lower(name) == lower(variable.name)) variable.units = units;
      }
      if (problem_.empty() && variable.levels > out_.z.count) {
        problem_ = "is invalid: the variable " + in_quotes(variable.name) + " has ";
        problem_ += std::to_string(variable.levels) + " levels, but zdef has " +
                    std::to_string(out_.z.count);
      }
    }
  }

  const InputFile& file_;
  Descriptor out_;
  std::vector<Line> lines_;
  std::size_t at_ = 0;
  std::vector<std::pair<std::string, std::string>> attributes_;
  std::string problem_;
};

}  // namespace

Result<Descriptor> parse_descriptor(const InputFile& file) { return Parser(file).parse(); }

}  // namespace windsplat::data::grads
