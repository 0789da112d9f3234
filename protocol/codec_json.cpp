// Text -> JSON tree: a SAX handler that stops at the first violation of a limit, so that the cost
// of untrusted text is bounded by its length.
#include "protocol/codec_json.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "protocol/limits.hpp"

namespace windsplat::protocol {

namespace {

constexpr int number_overflow_error = 406;  // error code of the parser: a number exceeds double
constexpr std::size_t token_bytes_max = 64;
constexpr double exact_integer_max = 9007199254740992.0;  // 2^53

// Truncates to at most `bytes_max` bytes at a code point boundary.
std::string_view cut_utf8(std::string_view text, std::size_t bytes_max) {
  if (text.size() <= bytes_max) return text;
  std::size_t end = bytes_max;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) --end;
  return text.substr(0, end);
}

// Builds the tree. Open containers are on a stack, from which the pointer of the current value is
// derived for error messages.
class TreeBuilder : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return put(Json(nullptr)); }
  bool boolean(bool value) override { return put(Json(value)); }
  bool number_integer(number_integer_t value) override { return put(Json(value)); }
  bool number_unsigned(number_unsigned_t value) override { return put(Json(value)); }
  bool number_float(number_float_t value, const string_t& /*text*/) override {
    return put(Json(value));
  }
  bool string(string_t& value) override { return put(Json(std::move(value))); }
  bool binary(binary_t& /*value*/) override { return false; }  // does not occur in JSON text

  bool start_object(std::size_t /*count*/) override { return open(Json::object()); }
  bool start_array(std::size_t /*count*/) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    Open& top = stack_.back();
    top.key = std::move(name);
    top.key_pending = true;
    if (top.value.contains(top.key)) {
      return refuse(ErrorKind::malformed, "duplicate key");
    }
    return true;
  }

  bool parse_error(std::size_t position, const std::string& /*token*/,
                   const nlohmann::detail::exception& fault) override {
    if (fault.id == number_overflow_error) {
      return refuse(ErrorKind::invalid, "number exceeds the range of a double");
    }
    return refuse(ErrorKind::malformed, "not valid JSON at byte " + std::to_string(position));
  }

  Json take() { return std::move(root_); }
  Error take_error() { return std::move(error_); }

 private:
  struct Open {
    Json value;
    std::string key;           // key of the current member, objects only
    bool key_pending = false;  // a key without its value yet
  };

  [[nodiscard]] std::string pointer() const {
    std::string out;
    for (const Open& open : stack_) {
      if (open.value.is_array()) {
        out = join_pointer(out, open.value.size());
      } else if (open.key_pending) {
        out = join_pointer(out, open.key);
      }
    }
    return out;
  }

  bool refuse(ErrorKind kind, std::string detail) {
    error_ = make_error_at(kind, pointer(), std::move(detail));
    return false;
  }

  bool open(Json empty) {
    if (stack_.size() >= limits::json_depth_max) {
      return refuse(ErrorKind::malformed,
                    "nested more than " + std::to_string(limits::json_depth_max) + " levels deep");
    }
    stack_.push_back(Open{std::move(empty), {}, false});
    return true;
  }

  bool close() {
    Json done = std::move(stack_.back().value);
    stack_.pop_back();
    return put(std::move(done));
  }

  bool put(Json value) {
    if (stack_.empty()) {
      root_ = std::move(value);
      return true;
    }
    Open& top = stack_.back();
    if (top.value.is_array()) {
      top.value.push_back(std::move(value));
    } else {
      top.value.emplace(top.key, std::move(value));
      top.key_pending = false;
    }
    return true;
  }

  std::vector<Open> stack_;
  Json root_;
  Error error_ = make_error(ErrorKind::malformed, "not valid JSON");
};

}  // namespace

Result<Json> parse_json(std::string_view text) {
  if (text.size() > limits::message_bytes_max) {
    return make_error(ErrorKind::too_large, "the document has " + std::to_string(text.size()) +
                                                " bytes; the limit is " +
                                                std::to_string(limits::message_bytes_max));
  }
  // The parser would treat a NUL as the end of input and skip a byte order mark; both are invalid.
  if (const auto nul = text.find('\0'); nul != std::string_view::npos) {
    return make_error_at(ErrorKind::malformed, "",
                         "not valid JSON: NUL at byte " + std::to_string(nul + 1));
  }
  if (text.substr(0, 3) == "\xef\xbb\xbf") {
    return make_error_at(ErrorKind::malformed, "", "not valid JSON: begins with a byte order mark");
  }
  TreeBuilder builder;
  if (!Json::sax_parse(text.begin(), text.end(), &builder)) return builder.take_error();
  return Result<Json>(boost::system::in_place_value, builder.take());
}

std::string dump(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json canonical_number(double value) {
  if (std::trunc(value) == value && std::abs(value) <= exact_integer_max) {
    return static_cast<std::int64_t>(value);
  }
  return value;
}

Json number_or_null(const std::optional<double>& value) {
  return value ? canonical_number(*value) : Json(nullptr);
}

Json numbers_json(const std::vector<double>& values) {
  Json out = Json::array();
  for (const double value : values) out.push_back(canonical_number(value));
  return out;
}

void make_numbers_canonical(Json& value) {
  if (value.is_number()) {
    value = canonical_number(value.get<double>());
  } else if (value.is_structured()) {
    for (Json& element : value) make_numbers_canonical(element);
  }
}

std::string join_pointer(const std::string& pointer, std::string_view key) {
  std::string out = pointer + "/";
  std::string escaped;
  for (const char c : cut_utf8(key, token_bytes_max)) {
    if (c == '~') {
      escaped += "~0";
    } else if (c == '/') {
      escaped += "~1";
    } else {
      escaped += c;
    }
  }
  out += printable(escaped, escaped.size() + 1);
  if (key.size() > token_bytes_max) out += "...";
  return out;
}

std::string join_pointer(const std::string& pointer, std::size_t index) {
  return pointer + "/" + std::to_string(index);
}

void Faults::add(std::string pointer, std::string detail, ErrorKind kind) {
  ++count_;
  if (kind == ErrorKind::invalid) kind_ = ErrorKind::invalid;
  if (at_.size() < limits::problem_errors_max) {
    at_.push_back(FieldError{std::move(pointer), std::move(detail)});
  }
}

Error Faults::error() const {
  Error error = make_error_at(kind_, at_.front().pointer, at_.front().detail);
  error.at = at_;
  if (count_ > 1) error.message += " (and " + std::to_string(count_ - 1) + " more)";
  return error;
}

std::string described(const Json& value) {
  if (value.is_object()) return "an object";
  if (value.is_array()) return "an array";
  const std::string text = dump(value);
  const std::string_view head = cut_utf8(text, token_bytes_max);
  return head.size() < text.size() ? std::string(head) + "..." : text;
}

}  // namespace windsplat::protocol
