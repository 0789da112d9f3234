// Converts blocks of an array to runs of bytes with constant stride, and these to numbers.
#include "server/data/formats/plain/placed_file.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>

#include "server/base/check.hpp"

namespace windsplat::data::bytes {

namespace {

constexpr std::uint64_t span_max = std::uint64_t{1} << 20;  // bytes read at a time

}  // namespace

int PlacedFile::add_dimension(std::string name, std::size_t length) {
  contents_.dimensions.push_back({.name = std::move(name), .length = length});
  return static_cast<int>(contents_.dimensions.size()) - 1;
}

void PlacedFile::add_axis(int dimension, const AxisLabel& label, std::vector<double> coordinates) {
  const FileDimension& along = contents_.dimensions.at(static_cast<std::size_t>(dimension));
  WINDSPLAT_CHECK(coordinates.size() == along.length);
  FileVariable variable;
  variable.name = along.name;
  variable.type = "float64";
  variable.numeric = true;
  variable.dims = {dimension};
  variable.units = label.units;
  variable.axis = label.axis;
  variable.positive = label.positive;
  variable.calendar = label.calendar;
  contents_.variables.push_back(std::move(variable));
  entries_.push_back({std::move(coordinates), std::nullopt, {}});
}

void PlacedFile::add_array(FileVariable variable, Placement placement,
                           std::vector<double> missing) {
  WINDSPLAT_CHECK(placement.strides.size() == variable.dims.size());
  WINDSPLAT_CHECK(placement.present.size() == variable.dims.size());
  variable.numeric = true;
  if (variable.type.empty()) variable.type = name_of(placement.type);
  contents_.variables.push_back(std::move(variable));
  entries_.push_back({{}, std::move(placement), std::move(missing)});
}

cf::Numbers PlacedFile::numbers(int variable, const char* attribute) const {
  const Entry& entry = entries_.at(static_cast<std::size_t>(variable));
  const std::string_view wanted = attribute;
  // The default fill values of netCDF do not apply to these formats: NaN replaces them.
  if (wanted == "_FillValue") return {{std::numeric_limits<double>::quiet_NaN()}, true};
  if (wanted == "missing_value" && entry.placement) {
    std::vector<double> values = entry.missing;
    for (double& value : values) value = entry.placement->negated ? -value : value;
    return {std::move(values), true};
  }
  return {};
}

std::string PlacedFile::text_of(int /*variable*/, const char* /*attribute*/) const { return {}; }

std::vector<std::size_t> PlacedFile::chunk(int variable) const {
  return std::vector<std::size_t>(
      contents_.variables.at(static_cast<std::size_t>(variable)).dims.size(), 1);
}

template <class T>
Result<void> PlacedFile::read_run(const Placement& placement, std::uint64_t offset,
                                  std::uint64_t stride, std::size_t count, T* out) const {
  const std::size_t size = size_of(placement.type);
  const bool plain = std::is_same_v<T, float> && placement.type == Scalar::float32 &&
                     placement.big_endian == (std::endian::native == std::endian::big);
  if (plain && stride == size) {
    auto* to = reinterpret_cast<unsigned char*>(out);
    if (auto done = placement.store->read(offset, to, count * size); !done) return done;
  } else {
    std::vector<unsigned char> span;
    const std::uint64_t fit = std::max<std::uint64_t>(1, span_max / std::max(stride, size));
    for (std::size_t done = 0; done < count;) {
      const auto some = static_cast<std::size_t>(std::min<std::uint64_t>(fit, count - done));
      span.resize((some - 1) * stride + size);
      if (auto read = placement.store->read(offset + done * stride, span.data(), span.size());
          !read) {
        return read;
      }
      decode(placement.type, placement.big_endian, span.data(), stride, some, out + done);
      done += some;
    }
  }
  if (placement.masked) {
    const auto [low, high] = *placement.masked;
    for (std::size_t i = 0; i < count; ++i) {
      const auto value = static_cast<double>(out[i]);
      if (value >= low && value <= high) out[i] = std::numeric_limits<T>::quiet_NaN();
    }
  }
  if (placement.negated) {
    for (std::size_t i = 0; i < count; ++i) out[i] = -out[i];
  }
  return {};
}

template <class T>
Result<void> PlacedFile::read_any(int variable, const std::vector<std::size_t>& start,
                                  const std::vector<std::size_t>& count, T* out) const {
  const Entry& entry = entries_.at(static_cast<std::size_t>(variable));
  if (!entry.placement) {
    std::transform(entry.values.begin() + static_cast<std::ptrdiff_t>(start[0]),
                   entry.values.begin() + static_cast<std::ptrdiff_t>(start[0] + count[0]), out,
                   [](double value) { return static_cast<T>(value); });
    return {};
  }
  const Placement& placement = *entry.placement;
  if (auto fine = placement.store->check_unchanged(); !fine) return fine;
  // Trailing dimensions with a common constant stride are one run.
  std::size_t rank = count.size();
  std::size_t run = count[rank - 1];
  const std::uint64_t stride = placement.strides[rank - 1];
  const auto whole = [&](std::size_t d) {
    return start[d] >= placement.present[d].begin &&
           start[d] + count[d] <= placement.present[d].end;
  };
  WINDSPLAT_CHECK(whole(rank - 1));
  for (--rank; rank > 0 && placement.strides[rank - 1] == stride * run && whole(rank - 1); --rank) {
    run *= count[rank - 1];
  }
  std::vector<std::size_t> index(rank, 0);
  for (;;) {
    std::uint64_t offset = placement.offset;
    bool absent = false;
    for (std::size_t d = 0; d < count.size(); ++d) {
      const std::size_t at = start[d] + (d < rank ? index[d] : 0);
      const Stored& present = placement.present[d];
      absent = absent || at < present.begin || at >= present.end;
      if (!absent) offset += (at - present.begin) * placement.strides[d];
    }
    if (absent) {
      std::fill_n(out, run, std::numeric_limits<T>::quiet_NaN());
    } else if (auto done = read_run(placement, offset, stride, run, out); !done) {
      return done;
    }
    out += run;
    std::size_t d = rank;
    for (; d > 0; --d) {
      if (++index[d - 1] < count[d - 1]) break;
      index[d - 1] = 0;
    }
    if (d == 0) return {};
  }
}

Result<void> PlacedFile::read(int variable, const std::vector<std::size_t>& start,
                              const std::vector<std::size_t>& count, double* out) const {
  return read_any(variable, start, count, out);
}

Result<void> PlacedFile::read(int variable, const std::vector<std::size_t>& start,
                              const std::vector<std::size_t>& count, float* out) const {
  return read_any(variable, start, count, out);
}

}  // namespace windsplat::data::bytes
