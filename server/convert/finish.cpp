#include "server/convert/finish.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "server/base/whole_file.hpp"
#include "server/convert/attributes.hpp"
#include "server/convert/checksums.hpp"
#include "server/convert/coordinates.hpp"
#include "server/convert/open_bricks.hpp"
#include "server/convert/pencil.hpp"
#include "server/data/formats/zarr/nodes.hpp"
#include "server/data/formats/zarr/write/shard_writer.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::convert {

namespace {

namespace fs = std::filesystem;
using data::zarr::ShardWriter;
using data::zarr::WrittenFile;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

// Numbers of a file from a place in bytes on.
template <class T>
Result<void> read_numbers(const fs::path& path, std::size_t offset, std::vector<T>& out) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(offset));
  file.read(reinterpret_cast<char*>(out.data()),
            static_cast<std::streamsize>(out.size() * sizeof(T)));
  if (file) return {};
  return make_error(ErrorKind::internal, "cannot read " + in_quotes(path.native()));
}

// All arrays and groups of a store. The root, which is the last, does not have the bytes of levels.
struct Described {
  std::vector<Coordinates> coordinates;
  std::vector<data::zarr::WrittenArray> arrays;
  std::vector<data::zarr::WrittenGroup> groups;
};

Described describe(const data::DatasetInfo& info, const Plan& plan) {
  Described out;
  out.arrays = plan.arrays;
  for (std::size_t level = 0; level < plan.levels.size(); ++level) {
    for (Coordinates& one : coordinates_of(info, plan, level)) {
      out.arrays.push_back(one.array);
      out.coordinates.push_back(std::move(one));
    }
  }
  out.groups = level_groups(info, plan);
  const std::vector<std::uint64_t> bytes(plan.levels.size());
  out.groups.push_back({"", root_attributes(info, plan, bytes, no_contents)});
  return out;
}

// Those of level 0, of ranges, and of the coarser levels without means, which are for others.
std::size_t arrays_read(const Plan& plan, const std::vector<data::zarr::WrittenArray>& arrays) {
  auto count = static_cast<std::size_t>(std::ranges::count_if(
      arrays, [](const auto& array) { return array.path.starts_with("0/"); }));
  for (const PlannedField& field : plan.fields) {
    count += 2;
    for (const Product& made : field.products) {
      const bool is_mean = made.as == Reduced::mean || made.as == Reduced::mean_magnitude;
      if (made.level > 0 && !is_mean) count += made.arrays.size();
    }
  }
  return count;
}

class Finisher {
 public:
  Finisher(const data::DatasetInfo& info, const Plan& plan, const fs::path& store,
           const CancelToken& cancel)
      : info_(info), plan_(plan), store_(store), cancel_(cancel) {
    numbers_.resize(plan.units.size());
    for (std::size_t n = 0; n < plan.units.size(); ++n) {
      const Unit& unit = plan.units[n];
      numbers_[index_of(unit.field, unit.step, unit.place)] = n;
    }
  }

  Result<std::uint64_t> run(const std::map<std::size_t, UnitFiles>& units) {
    for (const auto& [unit, files] : units) note(files.files);
    for (std::size_t f = 0; f < plan_.fields.size(); ++f) {
      std::vector<float> ranges;
      std::vector<double> masked;
      for (std::size_t step = 0; step < plan_.steps.size(); ++step) {
        if (auto done = write_levels(f, step); !done) return done.error();
        if (auto done = write_statistics(f, step, ranges, masked); !done) return done.error();
      }
      const PlannedField& field = plan_.fields[f];
      if (auto done = write_whole(field.range, ranges); !done) return done.error();
      if (auto done = write_masked(field.masked_of_step, masked); !done) return done.error();
    }
    return write_descriptions();
  }

 private:
  [[nodiscard]] std::size_t index_of(std::size_t field, std::size_t step, const Three& at) const {
    return (step * plan_.fields.size() + field) * product(plan_.units_along) +
           flat(at, plan_.units_along);
  }

  void note(const std::vector<WrittenFile>& files) {
    for (const WrittenFile& file : files) checksums_[file.path] = {file.bytes, file.crc32c};
  }
  Result<void> note(Result<std::vector<WrittenFile>> files) {
    if (!files) return files.error();
    note(*files);
    return {};
  }
  [[nodiscard]] Error interrupted() const {
    return make_error(ErrorKind::cancelled, "interrupted");
  }

  template <class T>
  Result<void> write_whole(std::size_t array, const std::vector<T>& items) {
    return note(write_array(store_, plan_.arrays[array], std::span<const T>(items)));
  }

  Result<void> write_masked(std::size_t array, const std::vector<double>& masked) {
    if (plan_.arrays[array].dtype.kind == 'f') return write_whole(array, masked);
    std::vector<std::uint32_t> counts;
    counts.reserve(masked.size());
    for (const double count : masked) counts.push_back(static_cast<std::uint32_t>(count));
    return write_whole(array, counts);
  }

  // The levels that units do not make.
  Result<void> write_levels(std::size_t f, std::size_t step) {
    for (const Product& made : plan_.fields[f].products) {
      const Level& level = plan_.level_of(made);
      if (level.by_unit) continue;
      const Three regions = over(level.dims, level.region);
      for (std::size_t n = 0; n < made.arrays.size(); ++n) {
        for (std::size_t r = 0; r < product(regions); ++r) {
          const auto at = static_cast<int>(r);
          const Three region{at % regions[0], at / regions[0] % regions[1],
                             at / regions[0] / regions[1]};
          if (auto done = write_region(f, step, made.arrays[n], level, region); !done) return done;
        }
      }
    }
    return {};
  }

  Result<void> write_region(std::size_t f, std::size_t step, std::size_t array, const Level& level,
                            const Three& region) {
    if (cancel_.cancelled()) return interrupted();
    const Three bricks = over(level.region, level.brick);
    Three first{};
    for (std::size_t a = 0; a < 3; ++a) first[a] = region[a] * level.region[a];
    ShardWriter writer(store_, plan_.arrays[array], region_place(level, step, first));
    std::vector<float> values;
    for (int z = 0; z < bricks[2]; ++z) {
      for (int y = 0; y < bricks[1]; ++y) {
        for (int x = 0; x < bricks[0]; ++x) {
          const data::Box room{{first[0] + x * level.brick[0], first[1] + y * level.brick[1],
                                first[2] + z * level.brick[2]},
                               level.brick};
          values.assign(product(level.brick), nan);
          if (auto done = gather(f, step, array, level, room, values); !done) return done;
          if (auto done = writer.add(flat({x, y, z}, bricks), values); !done) return done;
        }
      }
    }
    return note(writer.close());
  }

  // The samples of a box of a level, from the units that have them.
  Result<void> gather(std::size_t f, std::size_t step, std::size_t array, const Level& level,
                      const data::Box& room, std::vector<float>& values) {
    Three first{};
    Three last{};
    for (std::size_t a = 0; a < 3; ++a) {
      const int h = level.how.halvings[a];
      first[a] = (room.first[a] << h) / plan_.unit[a];
      const int end = std::min(room.first[a] + room.count[a], level.dims[a]);
      last[a] = std::min(((end << h) - 1) / plan_.unit[a], plan_.units_along[a] - 1);
    }
    for (int z = first[2]; z <= last[2]; ++z) {
      for (int y = first[1]; y <= last[1]; ++y) {
        for (int x = first[0]; x <= last[0]; ++x) {
          const std::size_t number = numbers_[index_of(f, step, {x, y, z})];
          const Kept kept(plan_, plan_.fields[f], plan_.box_of(plan_.units[number]));
          const auto piece = std::ranges::find(kept.pieces(), array, &Kept::Piece::array);
          std::vector<float> part(product(piece->box.count));
          auto read = read_numbers(kept_path(store_, number), piece->offset, part);
          if (!read) return read;
          copy_common(part.data(), piece->box, room, values.data());
        }
      }
    }
    return {};
  }

  Result<void> write_statistics(std::size_t f, std::size_t step, std::vector<float>& ranges,
                                std::vector<double>& masked) {
    if (cancel_.cancelled()) return interrupted();
    const PlannedField& field = plan_.fields[f];
    const Three bricks = over(plan_.dims, plan_.levels[0].brick);
    Statistics all(product(bricks));
    for (std::size_t u = 0; u < product(plan_.units_along); ++u) {
      const std::size_t number =
          numbers_[(step * plan_.fields.size() + f) * product(plan_.units_along) + u];
      if (auto done = add_unit(field, number, bricks, all); !done) return done;
    }
    std::array<float, 2> range{nan, nan};
    double sum = 0;
    for (std::size_t b = 0; b < all.low.size(); ++b) {
      sum += all.masked[b];
      if (!(all.low[b] <= all.high[b])) continue;
      if (!(range[0] <= all.low[b])) range[0] = all.low[b];
      if (!(range[1] >= all.high[b])) range[1] = all.high[b];
    }
    ranges.insert(ranges.end(), range.begin(), range.end());
    masked.push_back(sum);
    const std::vector<std::size_t> place{step, 0, 0, 0};
    const std::vector<std::size_t> place_of_bins{step, 0, 0, 0, 0};
    const auto write = [&](std::size_t array, const auto& at, const auto& items) {
      ShardWriter writer(store_, plan_.arrays[array], at);
      if (auto done = writer.add(0, std::span(items)); !done) return done;
      return note(writer.close());
    };
    if (auto done = write(field.low, place, all.low); !done) return done;
    if (auto done = write(field.high, place, all.high); !done) return done;
    if (auto done = write(field.masked, place, all.masked); !done) return done;
    return write(field.histogram, place_of_bins, all.histogram);
  }

  Result<void> add_unit(const PlannedField& field, std::size_t number, const Three& bricks,
                        Statistics& all) {
    const data::Box box = plan_.box_of(plan_.units[number]);
    const Kept kept(plan_, field, box);
    const std::size_t count = product(kept.bricks());
    Statistics part(count);
    const fs::path path = kept_path(store_, number);
    std::size_t at = 0;
    const auto read = [&](auto& numbers) {
      auto done = read_numbers(path, at, numbers);
      at += numbers.size() * sizeof numbers[0];
      return done;
    };
    if (auto done = read(part.low); !done) return done;
    if (auto done = read(part.high); !done) return done;
    if (auto done = read(part.masked); !done) return done;
    if (auto done = read(part.histogram); !done) return done;
    for (std::size_t b = 0; b < count; ++b) {
      const auto n = static_cast<int>(b);
      Three place{n % kept.bricks()[0], n / kept.bricks()[0] % kept.bricks()[1],
                  n / kept.bricks()[0] / kept.bricks()[1]};
      for (std::size_t a = 0; a < 3; ++a) place[a] += box.first[a] / plan_.levels[0].brick[a];
      BrickStatistics one{part.low[b], part.high[b], part.masked[b], {}};
      std::copy_n(part.histogram.begin() + static_cast<std::ptrdiff_t>(b * histogram_bins),
                  histogram_bins, one.histogram.begin());
      all.set(flat(place, bricks), one);
    }
    return {};
  }

  // Coordinates, checksums and metadata.
  Result<std::uint64_t> write_descriptions() {
    auto [coordinates, arrays, groups] = describe(info_, plan_);
    for (const Coordinates& one : coordinates) {
      auto done = note(write_array(store_, one.array, std::span<const double>(one.values)));
      if (!done) return done.error();
    }
    const std::vector<std::uint64_t> bytes = bytes_of_levels();
    groups.back().attributes = root_attributes(info_, plan_, bytes, no_contents);
    for (const auto& [path, text] : metadata_files(arrays, groups)) {
      checksums_[path] = checksum_of(text);
    }
    const std::string list = text_of(checksums_);
    if (auto done = write_whole_file(store_ / checksums_name, list, Sync::now); !done) {
      return done.error();
    }
    groups.back().attributes = root_attributes(info_, plan_, bytes, data::digest_of(list));
    if (auto done = write_metadata(store_, arrays, groups); !done) return done.error();
    if (auto done = remove_others(); !done) return done.error();
    std::uint64_t total = list.size();
    for (const auto& [path, sum] : checksums_) total += sum.bytes;
    return total;
  }

  // Of the files of their arrays.
  [[nodiscard]] std::vector<std::uint64_t> bytes_of_levels() const {
    std::vector<std::uint64_t> bytes;
    for (std::size_t level = 0; level < plan_.levels.size(); ++level) {
      const std::string folder = std::to_string(level) + '/';
      bytes.push_back(0);
      for (auto at = checksums_.lower_bound(folder);
           at != checksums_.end() && at->first.starts_with(folder); ++at) {
        bytes.back() += at->second.bytes;
      }
    }
    return bytes;
  }

  // What interrupted writes left.
  Result<void> remove_others() {
    std::error_code fault;
    std::vector<fs::path> others;
    for (auto at = fs::recursive_directory_iterator(store_, fault);
         !fault && at != fs::recursive_directory_iterator(); at.increment(fault)) {
      const fs::path path = at->path().lexically_relative(store_);
      const bool is_own = path == ".journal" || path == ".coarse" || path == checksums_name;
      if (path == ".coarse") at.disable_recursion_pending();
      if (!is_own && at->is_regular_file(fault) && !checksums_.contains(path.generic_string())) {
        others.push_back(at->path());
      }
    }
    for (const fs::path& path : others) fs::remove(path, fault);
    if (!fault) return {};
    return make_error(ErrorKind::internal,
                      "cannot look through " + in_quotes(store_.native()) + ": " + fault.message());
  }

  const data::DatasetInfo& info_;
  const Plan& plan_;
  const fs::path& store_;
  CancelToken cancel_;
  std::vector<std::size_t> numbers_;  // of units, by index_of()
  Checksums checksums_;
};

}  // namespace

Result<void> check_metadata(const data::DatasetInfo& info, const Plan& plan) {
  using data::zarr::arrays_max;
  using data::zarr::metadata_bytes_max;
  const Described all = describe(info, plan);
  if (auto fit = check_arrays(all.arrays); !fit) return fit;
  const auto refusal = [](const std::string& what, const std::string& most) {
    return make_error(ErrorKind::invalid, "the store would have " + what + ", and at most " + most +
                                              " are read; choose fewer fields by --field");
  };
  if (const std::size_t read = arrays_read(plan, all.arrays); read > arrays_max) {
    return refusal(std::to_string(read) + " arrays of fields and levels",
                   std::to_string(arrays_max));
  }
  for (const auto& [path, text] : metadata_files(all.arrays, all.groups)) {
    if (text.size() <= metadata_bytes_max) continue;
    return refusal(std::to_string(text.size() >> 10) + " KiB of metadata in " + in_quotes(path),
                   std::to_string(metadata_bytes_max >> 10) + " KiB");
  }
  return {};
}

Result<std::uint64_t> finish(const data::DatasetInfo& info, const Plan& plan, const fs::path& store,
                             const std::map<std::size_t, UnitFiles>& units,
                             const CancelToken& cancel) {
  return Finisher(info, plan, store, cancel).run(units);
}

}  // namespace windsplat::convert
