// Parses the clauses of the header and skips the numbers in between.
#include "server/data/formats/dx/module.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"
#include "server/data/bytes/unrolled.hpp"

namespace windsplat::data::dx {

namespace {

constexpr std::uint64_t header_max = std::uint64_t{4} << 20;
constexpr std::size_t objects_max = 100'000;
constexpr std::size_t word_max = 1024;
constexpr std::size_t rank_max = 8;

struct Word {
  std::string text;
  bool quoted = false;
  [[nodiscard]] bool is(std::string_view wanted) const { return !quoted && lower(text) == wanted; }
};

// Reads words of the file through a buffer.
class Words {
 public:
  explicit Words(std::shared_ptr<const InputFile> file) : file_(std::move(file)) {}

  // Returns an empty, unquoted word at the end.
  Word next() {
    if (held_) {
      Word word = std::move(*held_);
      held_.reset();
      return word;
    }
    before_ = at_;
    Word word;
    int c = skip_blanks();
    if (c == '"') {
      word.quoted = true;
      ++at_;
      while ((c = peek()) >= 0 && c != '"' && word.text.size() < word_max) take(word.text, c);
      if (c == '"') ++at_;
      return word;
    }
    while (c >= 0 && !is_blank(static_cast<char>(c)) && c != ',' && c != '"' &&
           word.text.size() < word_max) {
      take(word.text, c);
      c = peek();
    }
    return word;
  }
  void put_back(Word word) { held_ = std::move(word); }

  // Offset after the line of the last word.
  std::uint64_t next_line() {
    if (held_) at_ = before_;
    held_.reset();
    for (int c = peek(); c >= 0; c = peek()) {
      ++at_;
      if (c == '\n') break;
    }
    return at_;
  }
  // Continues at an offset; the skipped part does not count as header.
  void jump(std::uint64_t to) {
    skipped_ += to - std::min(to, at_);
    at_ = to;
    held_.reset();
  }
  [[nodiscard]] std::uint64_t at() const { return at_; }
  [[nodiscard]] bool too_long() const { return at_ - skipped_ > header_max; }
  [[nodiscard]] const std::optional<Error>& fault() const { return fault_; }

 private:
  void take(std::string& text, int c) {
    text += static_cast<char>(c);
    ++at_;
  }

  int skip_blanks() {
    bool comment = false;
    for (int c = peek(); c >= 0; c = peek()) {
      if (c == '#') comment = true;
      if (c == '\n') comment = false;
      if (!comment && c != ',' && !is_blank(static_cast<char>(c))) return c;
      ++at_;
    }
    return -1;
  }

  int peek() {
    if (at_ < begin_ || at_ >= begin_ + window_.size()) {
      const std::uint64_t left = file_->size() - std::min(at_, file_->size());
      window_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left, 65536)));
      begin_ = at_;
      if (window_.empty() || fault_) return -1;
      if (auto done = file_->read(at_, window_.data(), window_.size()); !done) {
        fault_ = done.error();
        return -1;
      }
    }
    return static_cast<unsigned char>(window_[static_cast<std::size_t>(at_ - begin_)]);
  }

  std::shared_ptr<const InputFile> file_;
  std::uint64_t at_ = 0;
  std::uint64_t before_ = 0;
  std::uint64_t skipped_ = 0;
  std::uint64_t begin_ = 0;
  std::string window_;
  std::optional<Word> held_;
  std::optional<Error> fault_;
};

struct ClassName {
  std::string_view name;
  Class kind;
};
constexpr auto class_names = std::to_array<ClassName>({{"array", Class::array},
                                                       {"gridpositions", Class::grid_positions},
                                                       {"gridconnections", Class::grid_connections},
                                                       {"regulararray", Class::regular},
                                                       {"productarray", Class::product},
                                                       {"field", Class::field},
                                                       {"series", Class::series},
                                                       {"group", Class::group}});

struct TypeName {
  std::string_view name;
  bytes::Scalar plain;
  bytes::Scalar without_sign;
};
constexpr auto type_names = std::to_array<TypeName>({
    {"float", bytes::Scalar::float32, bytes::Scalar::float32},
    {"double", bytes::Scalar::float64, bytes::Scalar::float64},
    {"int", bytes::Scalar::int32, bytes::Scalar::uint32},
    {"uint", bytes::Scalar::uint32, bytes::Scalar::uint32},
    {"short", bytes::Scalar::int16, bytes::Scalar::uint16},
    {"ushort", bytes::Scalar::uint16, bytes::Scalar::uint16},
    {"byte", bytes::Scalar::int8, bytes::Scalar::uint8},
    {"ubyte", bytes::Scalar::uint8, bytes::Scalar::uint8},
    {"char", bytes::Scalar::uint8, bytes::Scalar::uint8},
});

class Parser {
 public:
  explicit Parser(const std::shared_ptr<const InputFile>& file) : words_(file) { out_.file = file; }

  Result<Module> parse() {
    while (!problem_) {
      const Word word = words_.next();
      if (word.text.empty() && !word.quoted) {
        out_.data_begin = words_.at();
        break;
      }
      if (words_.too_long()) complain("has a header of more than 4 MiB");
      if (word.is("end")) {
        out_.data_begin = words_.next_line();
        break;
      }
      clause(word);
    }
    if (words_.fault()) return *words_.fault();
    if (problem_) return *problem_;
    if (out_.objects.empty()) return out_.file->fault("contains no objects");
    return std::move(out_);
  }

 private:
  void complain(const std::string& what) {
    if (problem_) return;
    problem_ = out_.file->fault("is not a valid DX file: byte " + std::to_string(words_.at()) +
                                ": " + what);
  }

  void clause(const Word& word) {
    if (word.is("object")) return begin_object();
    if (word.is("default")) {
      out_.chosen = words_.next().text;
      return;
    }
    if (out_.objects.empty()) return complain(in_quotes(word.text) + " before the first object");
    Object& object = out_.objects.back();
    if (word.is("attribute")) return attribute(object);
    const bool grid = object.kind == Class::grid_positions || object.kind == Class::regular ||
                      object.kind == Class::grid_connections;
    if (object.kind == Class::array && array_clause(object, word)) return;
    if (grid && grid_clause(object, word)) return;
    if (word.is("component") || word.is("member") || word.is("term")) return member(object, word);
    // Ignore the words of unknown kinds.
    if (object.kind != Class::other && !word.is("number") && !word.is("of")) {
      complain(in_quotes(word.text) + " is not understood in an object of class " +
               printable(object.class_name, 40));
    }
  }

  void begin_object() {
    if (out_.objects.size() == objects_max) return complain("more than 100000 objects");
    Object object;
    object.name = words_.next().text;
    Word word = words_.next();
    if (word.is("class")) word = words_.next();
    object.class_name = lower(word.text);
    const auto* at = std::find_if(class_names.begin(), class_names.end(), [&](const auto& known) {
      return known.name == object.class_name;
    });
    object.kind = at == class_names.end() ? Class::other : at->kind;
    object.big_endian = std::endian::native == std::endian::big;
    out_.objects.push_back(std::move(object));
  }

  void attribute(Object& object) {
    const std::string name = words_.next().text;
    Word value = words_.next();
    if (value.is("string") || value.is("number")) {
      value = words_.next();
    } else if (value.is("value")) {
      value = words_.next();  // an object, which is not used
      if (value.is("file")) {
        words_.next();
        words_.next();
      }
    }
    object.attributes[name] = value.text;
  }

  std::optional<std::uint64_t> whole_number() {
    Word word = words_.next();
    const auto value = bytes::to_integer(word.text);
    if (word.quoted || !value) {
      words_.put_back(std::move(word));
      return std::nullopt;
    }
    if (*value < 0) complain("the number " + std::to_string(*value) + " is negative");
    return static_cast<std::uint64_t>(std::max<std::int64_t>(0, *value));
  }

  std::uint64_t needed_number() {
    const auto value = whole_number();
    if (!value) complain("a whole number is needed");
    return value.value_or(0);
  }

  std::vector<std::uint64_t> whole_numbers() {
    std::vector<std::uint64_t> out;
    while (auto value = whole_number()) {
      if (out.size() == rank_max) {
        complain("more than " + std::to_string(rank_max) + " numbers");
        break;
      }
      out.push_back(*value);
    }
    return out;
  }

  std::vector<double> numbers() {
    std::vector<double> out;
    for (;;) {
      Word word = words_.next();
      const auto value = bytes::to_double(word.text);
      if (word.quoted || !value) {
        words_.put_back(std::move(word));
        return out;
      }
      if (!std::isfinite(*value) || out.size() == rank_max) {
        complain("more than " + std::to_string(rank_max) + " numbers, or an infinite one");
        return out;
      }
      out.push_back(*value);
    }
  }

  bool grid_clause(Object& object, const Word& word) {
    if (word.is("counts") || word.is("count")) {
      object.counts = whole_numbers();
    } else if (word.is("origin")) {
      object.origin = numbers();
    } else if (word.is("delta") || word.is("deltas")) {
      if (object.deltas.size() == rank_max) complain("too many deltas");
      object.deltas.push_back(numbers());
    } else if (word.is("type") || word.is("rank") || word.is("shape") || word.is("items")) {
      words_.next();
    } else if (const auto count = bytes::to_integer(word.text);
               count && !word.quoted && object.counts.empty()) {
      words_.put_back(word);
      object.counts = whole_numbers();
    } else {
      return false;
    }
    return true;
  }

  void set_type(Object& object) {
    Word word = words_.next();
    const bool without_sign = word.is("unsigned");
    if (without_sign || word.is("signed")) word = words_.next();
    const auto* at = std::find_if(type_names.begin(), type_names.end(),
                                  [&](const TypeName& known) { return word.is(known.name); });
    // Bytes are unsigned unless stated otherwise.
    if (at == type_names.end()) {
      object.numbers = false;
    } else if (at->name == "byte" && !signed_) {
      object.type = bytes::Scalar::uint8;
    } else {
      object.type = without_sign ? at->without_sign : at->plain;
    }
  }

  bool array_clause(Object& object, const Word& word) {
    if (word.is("type")) {
      Word sign = words_.next();
      signed_ = sign.is("signed");
      words_.put_back(std::move(sign));
      set_type(object);
    } else if (word.is("category")) {
      if (!words_.next().is("real")) object.numbers = false;
    } else if (word.is("rank")) {
      rank_ = needed_number();
      if (rank_ > rank_max) complain("a rank of more than " + std::to_string(rank_max));
    } else if (word.is("shape")) {
      object.shape = whole_numbers();
    } else if (word.is("items")) {
      object.items = needed_number();
    } else if (word.is("msb") || word.is("lsb")) {
      object.big_endian = word.is("msb");
      object.text = false;
    } else if (word.is("ieee") || word.is("binary")) {
      object.text = false;
    } else if (word.is("xdr")) {
      object.text = false;
      object.big_endian = true;
    } else if (word.is("text") || word.is("ascii")) {
      object.text = true;
    } else if (word.is("data")) {
      data_clause(object);
    } else {
      return false;
    }
    return true;
  }

  void data_clause(Object& object) {
    const Word where = words_.next();
    if (where.is("mode")) {  // msb, ieee, ... follow as separate words
      return;
    }
    object.has_data = true;
    if (where.is("follows")) return step_over(object);
    if (where.is("file")) {
      object.data_file = words_.next().text;
      object.data_at = whole_number().value_or(0);
      return;
    }
    const auto at = bytes::to_integer(where.text);
    if (!at || *at < 0) return complain("'follows', 'file' or a number is needed after 'data'");
    object.data_at = static_cast<std::uint64_t>(*at);
  }

  void step_over(Object& object) {
    object.follows = true;
    std::vector<std::uint64_t> factors = object.shape;
    factors.push_back(object.items);
    factors.push_back(object.text ? 1 : bytes::size_of(object.type));
    const auto size = bytes::product(factors);
    const std::uint64_t from = object.text ? words_.at() : words_.next_line();
    object.data_at = from;
    const std::uint64_t left = out_.file->size() - from;
    if (!object.numbers) return complain("text instead of numbers is not supported");
    if (!size || *size > left) {
      return complain("is truncated: the array has more numbers than the file has bytes");
    }
    if (!object.text) return words_.jump(from + *size);
    const auto end = bytes::end_of_text(out_.file, from, *size);
    if (!end) {
      problem_ = end.error();
      return;
    }
    words_.jump(*end);
  }

  Reference reference() {
    Reference out;
    Word word = words_.next();
    if (word.is("value")) word = words_.next();
    if (!word.is("file")) {
      out.name = word.text;
      return out;
    }
    out.file = words_.next().text;
    Word name = words_.next();
    const bool clause_begins =
        !name.quoted &&
        (name.is("member") || name.is("component") || name.is("object") || name.is("attribute") ||
         name.is("end") || name.is("position") || name.text.empty());
    if (clause_begins) {
      words_.put_back(std::move(name));
    } else {
      out.name = name.text;
    }
    return out;
  }

  void position(Member& member) {
    Word word = words_.next();
    if (!word.is("position")) return words_.put_back(std::move(word));
    const auto position = bytes::to_double(words_.next().text);
    if (!position || !std::isfinite(*position)) complain("a position must be a number");
    member.position = position.value_or(0);
  }

  void member(Object& object, const Word& word) {
    if (object.members.size() == objects_max) return complain("more than 100000 members");
    Member member;
    if (!word.is("term")) member.name = words_.next().text;
    member.position =
        bytes::to_double(member.name).value_or(static_cast<double>(object.members.size()));
    position(member);
    member.value = reference();
    position(member);  // written here by the samples of the format
    object.members.push_back(std::move(member));
  }

  Words words_;
  Module out_;
  std::uint64_t rank_ = 0;
  bool signed_ = false;
  std::optional<Error> problem_;
};

}  // namespace

const Object* Module::find(const std::string& name) const {
  if (name.empty()) {
    if (!chosen.empty()) return find(chosen);
    return &objects.back();
  }
  const auto at = std::find_if(objects.rbegin(), objects.rend(),
                               [&](const Object& object) { return object.name == name; });
  return at == objects.rend() ? nullptr : &*at;
}

Result<Module> parse_module(const std::shared_ptr<const InputFile>& file) {
  return Parser(file).parse();
}

}  // namespace windsplat::data::dx
