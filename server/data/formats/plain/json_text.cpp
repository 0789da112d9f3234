#include "server/data/formats/plain/json_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace windsplat::data::json_text {

namespace {

constexpr int depth_max = 8;
constexpr std::size_t text_max = 4096;

// Checks depth and keys while the text is parsed.
class Watch {
 public:
  bool operator()(int depth, Json::parse_event_t event, Json& parsed) {
    if (depth > depth_max) {
      throw Refused{"the document: nested deeper than " + std::to_string(depth_max)};
    }
    if (event == Json::parse_event_t::object_start) {
      keys_.emplace_back();
    } else if (event == Json::parse_event_t::object_end) {
      keys_.pop_back();
    } else if (event == Json::parse_event_t::key &&
               !keys_.back().insert(parsed.get<std::string>()).second) {
      throw Refused{"the document: the key " + in_quotes(parsed.get<std::string>()) +
                    " occurs twice in one object"};
    }
    return true;
  }

 private:
  std::vector<std::set<std::string>> keys_;
};

}  // namespace

void refuse(const std::string& pointer, const std::string& what) {
  throw Refused{(pointer.empty() ? std::string("the document") : pointer) + ": " + what};
}

Result<void> parse(std::string_view text, const std::function<void(const Json&)>& use) {
  try {
    use(Json::parse(text, Watch()));
    return {};
  } catch (const Refused& refused) {
    return make_error(ErrorKind::bad_data, "is invalid: " + refused.what);
  } catch (const Json::exception& fault) {
    return make_error(ErrorKind::bad_data, "is not valid JSON: " + printable(fault.what()));
  }
}

std::string number_text(double value) {
  std::array<char, 40> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  return {digits.data(), end.ptr};
}

Object::Object(const Json& value, std::string pointer, std::initializer_list<std::string_view> keys)
    : value_(value), pointer_(std::move(pointer)) {
  if (!value.is_object()) refuse(pointer_, "must be an object");
  for (const auto& [key, member] : value.items()) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      refuse(below(printable(key, 40)), "unknown key");
    }
  }
}

const Json& Object::at(const char* key) const {
  const auto found = value_.find(key);
  if (found == value_.end()) refuse(below(key), "is required");
  return *found;
}

std::string Object::text(const char* key, const std::string& otherwise) const {
  return has(key) ? text_of(at(key), below(key)) : otherwise;
}

std::int64_t Object::integer(const char* key, std::int64_t least, std::int64_t most) const {
  return integer_of(at(key), below(key), least, most);
}

std::int64_t Object::integer(const char* key, std::int64_t least, std::int64_t most,
                             std::int64_t otherwise) const {
  return has(key) ? integer(key, least, most) : otherwise;
}

double Object::number(const char* key, double otherwise) const {
  return has(key) ? number_of(at(key), below(key)) : otherwise;
}

std::string Object::text_of(const Json& value, const std::string& pointer) {
  if (!value.is_string()) refuse(pointer, "must be a string");
  auto text = value.get<std::string>();
  if (text.size() > text_max) {
    refuse(pointer, "is longer than " + std::to_string(text_max) + " bytes");
  }
  return text;
}

std::int64_t Object::integer_of(const Json& value, const std::string& pointer, std::int64_t least,
                                std::int64_t most) {
  const bool unsigned_fits =
      value.is_number_unsigned() &&
      value.get<std::uint64_t>() <=
          static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  const bool fits = value.is_number_unsigned() ? unsigned_fits : value.is_number_integer();
  const std::int64_t number = fits ? value.get<std::int64_t>() : 0;
  if (!fits || number < least || number > most) {
    refuse(pointer,
           "must be a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return number;
}

double Object::number_of(const Json& value, const std::string& pointer) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) {
    refuse(pointer, "must be a finite number");
  }
  return value.get<double>();
}

std::vector<double> Object::numbers_of(const Json& value, const std::string& pointer,
                                       std::size_t most) {
  if (!value.is_array() || value.size() > most) {
    refuse(pointer, "must be a list of at most " + std::to_string(most) + " numbers");
  }
  std::vector<double> out;
  for (const Json& entry : value) {
    out.push_back(number_of(entry, pointer + '/' + std::to_string(out.size())));
  }
  return out;
}

}  // namespace windsplat::data::json_text
