#include "server/data/formats/dap/dds.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <utility>

#include "server/data/formats/dap/text.hpp"

namespace windsplat::data::dap {

namespace {

struct DdsTypeName {
  std::string_view name;
  Type type;
};
constexpr auto dds_types = std::to_array<DdsTypeName>({{"byte", Type::uint8},
                                                       {"int16", Type::int16},
                                                       {"uint16", Type::uint16},
                                                       {"int32", Type::int32},
                                                       {"uint32", Type::uint32},
                                                       {"float32", Type::float32},
                                                       {"float64", Type::float64},
                                                       {"string", Type::text},
                                                       {"url", Type::text}});

class DdsParser {
 public:
  // `sent`: an answer, in which arrays may be in structures.
  DdsParser(std::string_view text, bool sent) : words_(text), sent_(sent) {}

  Result<Dds> parse() {
    if (!words_.take().is_name("dataset") || !words_.take('{')) return malformed("'Dataset {'");
    while (!words_.peek().is('}')) {
      if (auto done = declaration(); !done) return done.error();
    }
    words_.take();
    if (words_.take().kind != Word::Kind::name || !words_.take(';')) return malformed("its name");
    if (sent_) return std::move(out_);
    for (Array& map : maps_) {
      const bool known = std::any_of(out_.arrays.begin(), out_.arrays.end(),
                                     [&](const Array& one) { return one.name == map.name; });
      if (!known) out_.arrays.push_back(std::move(map));
    }
    if (auto same = check_dimensions(); !same) return same.error();
    return std::move(out_);
  }

 private:
  static Error malformed(const std::string& expected) {
    return make_error(ErrorKind::bad_data,
                      "its description (DDS) is malformed: " + expected + " is missing");
  }

  Result<void> declaration() {
    if (words_.peek().is_name("grid")) return grid();
    if (sent_ && words_.peek().is_name("structure")) return structure();
    for (const DdsTypeName& one : dds_types) {
      if (!words_.peek().is_name(one.name)) continue;
      auto array = this->array();
      if (!array) return array.error();
      return add(out_.arrays, std::move(*array));
    }
    if (words_.peek().kind != Word::Kind::name) return malformed("the type of a variable");
    return other();
  }

  // A structure, sequence or list: of a block the name behind it, otherwise the last word.
  Result<void> other() {
    std::string name;
    int depth = 0;
    for (;;) {
      const Word word = words_.take();
      if (word.kind == Word::Kind::none) return malformed("the end of a declaration");
      if (word.is('{') && ++depth > depth_max) return malformed("a declaration of less depth");
      if (word.is('}')) --depth;
      if (depth < 0) return malformed("a declaration");
      if (word.kind == Word::Kind::name && depth == 0 && !words_.peek().is(']')) name = word.text;
      if (word.is(';') && depth == 0) break;
    }
    if (out_.others.size() < arrays_max) out_.others.push_back(std::move(name));
    return {};
  }

  Result<void> structure() {
    words_.take();
    if (!words_.take('{') || ++depth_ > depth_max) return malformed("a structure");
    while (!words_.peek().is('}')) {
      if (auto done = declaration(); !done) return done;
    }
    words_.take();
    --depth_;
    if (words_.take().kind != Word::Kind::name || !words_.take(';')) {
      return malformed("the name of a structure");
    }
    return {};
  }

  Result<void> grid() {
    words_.take();
    if (!words_.take('{')) return malformed("'{' of a grid");
    std::vector<Array> members;
    while (!words_.peek().is('}')) {
      if (words_.peek().is_name("array:") || words_.peek().is_name("maps:")) {
        words_.take();
        continue;
      }
      if (words_.peek().is_name("array") || words_.peek().is_name("maps")) {
        words_.take();
        if (!words_.take(':')) return malformed("':' of a grid");
        continue;
      }
      auto member = array();
      if (!member) return member.error();
      members.push_back(std::move(*member));
      if (members.size() > 1 + rank_max) return malformed("the end of a grid");
    }
    words_.take();
    const Word name = words_.take();
    if (name.kind != Word::Kind::name || !words_.take(';') || members.empty()) {
      return malformed("the name of a grid");
    }
    for (Array& member : members) member.path = name.text + '.' + member.name;
    members.front().name = name.text;
    for (std::size_t n = 1; n < members.size(); ++n) {
      if (auto added = add(maps_, std::move(members[n])); !added) return added;
    }
    return add(out_.arrays, std::move(members.front()));
  }

  static Result<void> add(std::vector<Array>& to, Array array) {
    if (to.size() >= arrays_max) {
      return make_error(ErrorKind::bad_data, "its description (DDS) has more than " +
                                                 std::to_string(arrays_max) + " variables");
    }
    to.push_back(std::move(array));
    return {};
  }

  // "Float32 u[time = 4][lat = 3];"
  Result<Array> array() {
    const Word type = words_.take();
    const auto* const known =
        std::find_if(dds_types.begin(), dds_types.end(),
                     [&](const DdsTypeName& one) { return type.is_name(one.name); });
    const Word name = words_.take();
    if (known == dds_types.end() || name.kind != Word::Kind::name) return malformed("a variable");
    Array out;
    out.type = known->type;
    out.name = name.text;
    out.path = name.text;
    while (words_.take('[')) {
      Dimension dimension;
      Word length = words_.take();
      if (words_.take('=')) {
        dimension.name = length.text;
        length = words_.take();
      } else {
        dimension.name = out.name + '_' + std::to_string(out.dims.size());
      }
      const char* const end = length.text.data() + length.text.size();
      const auto [at, fault] = std::from_chars(length.text.data(), end, dimension.length);
      constexpr std::uint64_t length_max = std::uint64_t{1} << 31;  // of XDR
      if (fault != std::errc() || at != end || dimension.length > length_max || !words_.take(']') ||
          out.dims.size() >= rank_max) {
        return malformed("the length of a dimension");
      }
      out.dims.push_back(std::move(dimension));
    }
    if (!words_.take(';')) return malformed("';' behind a variable");
    return out;
  }

  Result<void> check_dimensions() const {
    std::map<std::string, std::uint64_t> lengths;
    for (const Array& array : out_.arrays) {
      for (const Dimension& dimension : array.dims) {
        const auto [at, is_new] = lengths.emplace(dimension.name, dimension.length);
        if (is_new || at->second == dimension.length) continue;
        return make_error(ErrorKind::bad_data,
                          "its dimension " + in_quotes(dimension.name) + " has different lengths");
      }
    }
    return {};
  }

  Words words_;
  bool sent_;
  int depth_ = 0;
  Dds out_;
  std::vector<Array> maps_;
};

}  // namespace

Result<Dds> parse_dds(std::string_view text) { return DdsParser(text, false).parse(); }

Result<Array> parse_sent(std::string_view text) {
  auto described = DdsParser(text, true).parse();
  if (!described) return described.error();
  if (described->arrays.size() == 1) return std::move(described->arrays.front());
  return make_error(ErrorKind::bad_data, "the service sends other variables than were asked for");
}

}  // namespace windsplat::data::dap
