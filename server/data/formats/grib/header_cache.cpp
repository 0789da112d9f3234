// Octets of sections 1 and 4 of edition 2 (templates 4.0, 4.1, 4.2, 4.8, 4.11 and 4.12), and of
// section 1 of edition 1.
#include "server/data/formats/grib/header_cache.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "server/data/formats/grib/levels.hpp"

namespace windsplat::data::grib {

namespace {

using Bytes = std::vector<unsigned char>;

constexpr std::size_t known_bytes_max = std::size_t{16} << 20;

struct Timed {
  std::string key;
  double reference = 0;  // hours since 1970-01-01
  double step = 0;       // hours
  bool is_instant = true;
  std::optional<double> level;  // if the key is without it
};

long number_at(const Bytes& bytes, std::size_t at, std::size_t count) {
  long value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8U | bytes[at + i];
  return value;
}

// Code table 4.4; the same numbers in table 4 of edition 1. None for months and beyond, and
// seconds.
std::optional<double> hours_in(unsigned char unit) {
  constexpr auto units = std::to_array<std::pair<int, double>>(
      {{0, 1.0 / 60}, {1, 1}, {2, 24}, {10, 3}, {11, 6}, {12, 12}});
  const auto* at = std::find_if(units.begin(), units.end(),
                                [unit](const auto& one) { return one.first == unit; });
  return at == units.end() ? std::nullopt : std::optional(at->second);
}

void blank(std::string& key, std::size_t at, std::size_t count) {
  std::fill_n(key.begin() + static_cast<std::ptrdiff_t>(at), count, '\0');
}

std::string text(const Bytes& bytes, std::size_t from) {
  return {bytes.begin() + static_cast<std::ptrdiff_t>(from), bytes.end()};
}

// Where a section of edition 2 begins; 0 if it is absent.
std::size_t section(const Bytes& head, unsigned char number) {
  for (std::size_t at = 16; at + 5 <= head.size();) {
    if (head[at + 4] == number) return at;
    const long length = number_at(head, at, 4);
    if (length < 5) return 0;
    at += static_cast<std::size_t>(length);
  }
  return 0;
}

// Pressures in hPa and numbers of hybrid levels, for which no name of ecCodes depends on the level.
void blank_level_2(const Bytes& head, std::size_t four, Timed& out) {
  constexpr unsigned char pressure = 100;  // code table 4.5
  constexpr unsigned char hybrid = 105;
  constexpr unsigned char none = 255;
  const unsigned char type = head[four + 22];
  const unsigned char factor = head[four + 23];
  const bool by_number = type == hybrid && factor == 0;
  if ((type != pressure && !by_number) || head[four + 28] != none || factor == none) return;
  const long exponent = (factor & 0x80) != 0 ? -long{factor & 0x7f} : long{factor};
  const double value = scaled(number_at(head, four + 24, 4), exponent);
  if (std::isnan(value)) return;
  out.level = by_number ? value : value / 100;
  blank(out.key, four + 24, 4);
}

void blank_level_1(const Bytes& head, std::size_t begin, Timed& out) {
  constexpr unsigned char pressure = 100;  // code table 3
  constexpr unsigned char hybrid = 109;
  constexpr unsigned char table_with_levels = 202;  // has a name for one level
  const unsigned char type = head[begin + 9];
  if ((type != pressure && type != hybrid) || head[begin + 3] == table_with_levels) return;
  out.level = static_cast<double>(number_at(head, begin + 10, 2));
  blank(out.key, begin + 10, 2);
}

std::optional<Timed> timed_2(const Bytes& head) {
  constexpr std::size_t smallest = 34;  // bytes of section 4
  const std::size_t one = section(head, 1);
  const std::size_t four = section(head, 4);
  if (one == 0 || four < one + 21 || four + smallest > head.size()) return {};
  // The end of a range of time; 0 for instants.
  constexpr auto templates = std::to_array<std::pair<long, std::size_t>>(
      {{0, 0}, {1, 0}, {2, 0}, {8, 34}, {11, 37}, {12, 36}});
  const auto* known = std::find_if(templates.begin(), templates.end(), [&](const auto& t) {
    return t.first == number_at(head, four + 7, 2);
  });
  const auto unit = hours_in(head[four + 17]);
  const long forecast = number_at(head, four + 18, 4);
  constexpr long forecast_max = 0x7fffffff;  // beyond: negative
  if (known == templates.end() || !unit || forecast > forecast_max || head[one + 18] != 0) {
    return {};
  }
  Timed out{text(head, 0), 0, static_cast<double>(forecast) * *unit, known->second == 0, {}};
  blank(out.key, 8, 8);  // length of the message
  blank(out.key, one + 12, 7);
  blank(out.key, four + 18, 4);
  blank_level_2(head, four, out);
  if (!out.is_instant) {
    const std::size_t end = four + known->second;
    if (end + 19 > head.size() || head[end + 7] != 1 || !hours_in(head[end + 14])) return {};
    blank(out.key, end, 7);
  }
  out.reference =
      hours_of(number_at(head, one + 12, 2) * 10000 + head[one + 14] * 100L + head[one + 15],
               head[one + 16] * 100L + head[one + 17]);
  return out;
}

std::optional<Timed> timed_1(const Bytes& head) {
  constexpr std::size_t begin = 8;  // of section 1
  constexpr std::size_t smallest = 28;
  if (head.size() < begin + smallest || number_at(head, begin, 3) < static_cast<long>(smallest))
    return {};
  const unsigned char range = head[begin + 20];  // table 5: 0 and 10 are instants
  const auto unit = hours_in(head[begin + 17]);
  if ((range != 0 && range != 10) || !unit) return {};
  const std::size_t octets = range == 0 ? 1 : 2;
  const auto step = static_cast<double>(number_at(head, begin + 18, octets)) * *unit;
  Timed out{text(head, 0), 0, step, true, {}};
  blank(out.key, 4, 3);  // length of the message
  blank(out.key, begin + 12, 5);
  blank(out.key, begin + 18, octets);
  blank(out.key, begin + 24, 1);
  blank_level_1(head, begin, out);
  const long year = (head[begin + 24] - 1L) * 100 + head[begin + 12];
  out.reference = hours_of(year * 10000 + head[begin + 13] * 100L + head[begin + 14],
                           head[begin + 15] * 100L + head[begin + 16]);
  return out;
}

std::optional<Timed> timed(int edition, const Bytes& head) {
  if (head.empty()) return {};
  auto out = edition == 1 ? timed_1(head) : timed_2(head);
  return out && std::isfinite(out->reference) ? std::move(out) : std::nullopt;
}

}  // namespace

std::optional<Header> HeaderCache::find(int edition, const Bytes& head) const {
  const auto found = timed(edition, head);
  if (!found) return {};
  const auto at = known_.find(found->key);
  if (at == known_.end()) return {};
  Header out = at->second.header;
  out.reference = found->reference;
  if (found->level) out.level = *found->level;
  out.hours = found->reference + found->step + at->second.range_hours;
  return out;
}

void HeaderCache::remember(int edition, const Bytes& head, const Header& header) {
  auto found = timed(edition, head);
  if (!found || bytes_ + head.size() > known_bytes_max) return;
  constexpr double tolerance = 1e-6;  // hours
  const double range = header.hours - found->reference - found->step;
  if (std::abs(header.reference - found->reference) > tolerance || range < -tolerance ||
      (found->is_instant && range > tolerance) || (found->level && *found->level != header.level)) {
    return;
  }
  bytes_ += head.size();
  known_.emplace(std::move(found->key), Known{header, found->is_instant ? 0 : range});
}

}  // namespace windsplat::data::grib
