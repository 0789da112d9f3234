// A SAX handler that builds the tree and stops at the first violation of a limit.
#include "server/data/formats/zarr/json.hpp"

#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace windsplat::data::zarr {

namespace {

constexpr std::size_t depth_max = 32;

class TreeBuilder : public nlohmann::json_sax<nlohmann::json> {
 public:
  bool null() override { return put({}); }
  bool boolean(bool value) override {
    Json out;
    out.kind = Json::Kind::boolean;
    out.number = value ? 1 : 0;
    return put(std::move(out));
  }
  bool number_integer(number_integer_t value) override {
    return put_number(static_cast<double>(value), true, value);
  }
  bool number_unsigned(number_unsigned_t value) override {
    const bool fits = value <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    return put_number(static_cast<double>(value), fits,
                      fits ? static_cast<std::int64_t>(value) : 0);
  }
  bool number_float(number_float_t value, const string_t& /*text*/) override {
    return put_number(value, false, 0);
  }
  bool string(string_t& value) override {
    Json out;
    out.kind = Json::Kind::text;
    out.text = std::move(value);
    return put(std::move(out));
  }
  bool binary(binary_t& /*value*/) override { return false; }  // does not occur in JSON text

  bool start_object(std::size_t /*count*/) override { return open(Json::Kind::object); }
  bool start_array(std::size_t /*count*/) override { return open(Json::Kind::list); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    Open& top = stack_.back();
    if (top.value.object.contains(name)) {
      fault_ = "duplicate key " + in_quotes(name);
      return false;
    }
    top.key = std::move(name);
    return true;
  }

  bool parse_error(std::size_t position, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*fault*/) override {
    fault_ = "it is not valid JSON at byte " + std::to_string(position);
    return false;
  }

  Json take() { return std::move(root_); }
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  struct Open {
    Json value;
    std::string key;  // key of the member being read
  };

  bool put_number(double value, bool is_integer, std::int64_t integer) {
    Json out;
    out.kind = Json::Kind::number;
    out.number = value;
    out.is_integer = is_integer;
    out.integer = integer;
    return put(std::move(out));
  }

  bool open(Json::Kind kind) {
    if (stack_.size() >= depth_max) {
      fault_ = "it is nested more than " + std::to_string(depth_max) + " levels deep";
      return false;
    }
    stack_.emplace_back();
    stack_.back().value.kind = kind;
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
    } else if (Open& top = stack_.back(); top.value.kind == Json::Kind::list) {
      top.value.list.push_back(std::move(value));
    } else {
      top.value.object.emplace(std::move(top.key), std::move(value));
    }
    return true;
  }

  std::vector<Open> stack_;
  Json root_;
  std::string fault_ = "it is not valid JSON";
};

// Quotes NaN, Infinity and -Infinity where they are unquoted.
std::string quote_bare_words(std::string_view text) {
  std::string out;
  out.reserve(text.size() + 64);
  bool in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_text && c == '\\' && i + 1 < text.size()) {
      out += c;
      out += text[++i];
      continue;
    }
    if (c == '"') in_text = !in_text;
    bool replaced = false;
    for (const std::string_view word : {"NaN", "Infinity", "-Infinity"}) {
      if (!in_text && !replaced && text.substr(i, word.size()) == word) {
        out += '"';
        out += word;
        out += '"';
        i += word.size() - 1;
        replaced = true;
      }
    }
    if (!replaced) out += c;
  }
  return out;
}

}  // namespace

const Json* Json::find(std::string_view key) const {
  const auto at = object.find(key);
  return at == object.end() ? nullptr : &at->second;
}

std::string Json::text_at(std::string_view key) const {
  const Json* found = find(key);
  return found == nullptr ? "" : found->text;
}

Result<Json> parse_json(std::string_view text) {
  // The parser would treat a NUL as the end of its input.
  if (text.find('\0') != std::string_view::npos) {
    return make_error(ErrorKind::bad_data, "it is not valid JSON: it contains a NUL");
  }
  const std::string plain = quote_bare_words(text);
  TreeBuilder builder;
  if (!nlohmann::json::sax_parse(plain, &builder)) {
    return make_error(ErrorKind::bad_data, builder.fault());
  }
  return builder.take();
}

}  // namespace windsplat::data::zarr
