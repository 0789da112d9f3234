#include "server/data/formats/dap/das.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"
#include "server/data/formats/dap/text.hpp"

namespace windsplat::data::dap {

namespace {

std::optional<double> attribute_number(const std::string& text) {
  if (const auto number = bytes::to_double(text)) return number;
  if (lower(text).find("nan") != std::string::npos) return std::numeric_limits<double>::quiet_NaN();
  return {};
}

class DasParser {
 public:
  explicit DasParser(std::string_view text) : words_(text) {}

  Result<std::map<std::string, Attributes>> parse() {
    if (!words_.take().is_name("attributes") || !words_.take('{')) {
      return malformed("'Attributes {'");
    }
    while (!words_.take('}')) {
      const Word name = words_.take();
      if (name.kind != Word::Kind::name) return malformed("the name of a variable");
      if (!words_.take('{')) {  // an alias
        if (!words_.skip()) return malformed("the end of an alias");
        continue;
      }
      if (auto done = attributes(out_[name.text]); !done) return done.error();
    }
    return std::move(out_);
  }

 private:
  static Error malformed(const std::string& expected) {
    return make_error(ErrorKind::bad_data,
                      "its attributes (DAS) are malformed: " + expected + " is missing");
  }

  Result<void> attributes(Attributes& to) {
    while (!words_.take('}')) {
      const Word type = words_.take();
      if (type.kind != Word::Kind::name) return malformed("the type of an attribute");
      const Word name = words_.peek();
      if (name.is('{') || type.is_name("alias")) {
        if (!words_.skip()) return malformed("the end of attributes");
        continue;
      }
      words_.take();
      if (name.kind != Word::Kind::name) return malformed("the name of an attribute");
      if (++count_ > attributes_max) {
        return make_error(ErrorKind::bad_data, "it has more than " +
                                                   std::to_string(attributes_max) +
                                                   " attributes and values of them");
      }
      if (auto done = values(type, to[name.text]); !done) return done;
    }
    return {};
  }

  Result<void> values(const Word& type, Attribute& out) {
    out = {};
    constexpr auto numbers = std::to_array<std::string_view>(
        {"byte", "int16", "uint16", "int32", "uint32", "float32", "float64"});
    // Also of types of other services, such as OtherXML of Hyrax.
    out.is_text = !is_one_of(lower(type.text), numbers);
    out.is_floating = type.is_name("float32") || type.is_name("float64");
    do {
      const Word value = words_.take();
      if (value.kind != Word::Kind::name && value.kind != Word::Kind::quoted) {
        return malformed("the value of an attribute");
      }
      if (++count_ > attributes_max) return malformed("the end of the values of an attribute");
      if (out.is_text) {
        if (!out.text.empty()) out.text += '\n';
        out.text += value.text;
        continue;
      }
      const auto number = attribute_number(value.text);
      if (!number) return malformed("a number of an attribute");
      out.numbers.push_back(*number);
    } while (words_.take(','));
    if (!words_.take(';')) return malformed("';' behind an attribute");
    return {};
  }

  Words words_;
  std::map<std::string, Attributes> out_;
  std::size_t count_ = 0;
};

}  // namespace

Result<std::map<std::string, Attributes>> parse_das(std::string_view text) {
  return DasParser(text).parse();
}

}  // namespace windsplat::data::dap
