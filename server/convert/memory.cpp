#include "server/convert/memory.hpp"

#include <algorithm>

#include "server/base/check.hpp"
#include "server/convert/open_files.hpp"
#include "server/convert/pencil.hpp"

namespace windsplat::convert {

namespace {

constexpr std::uint64_t mebi = std::uint64_t{1} << 20;
constexpr std::uint64_t program_bytes = 64 * mebi;  // program, libraries, description
constexpr std::uint64_t loader_bytes_min = 64 * mebi;
constexpr std::uint64_t loader_bytes_max = 256 * mebi;
constexpr std::uint64_t chunks_at_a_time = 4;  // caches and buffers of the libraries
// Transfers up to this size are kept beside the volume that is read (loader/transfer.hpp).
constexpr std::uint64_t transfer_bytes_max = 32 * mebi;
constexpr std::uint64_t worker_bytes = 6 * mebi;  // stack, buffers of the allocator, indices
constexpr int growth_max = 3;                     // at most 8 x 8 pencils at once

std::uint64_t floats(std::size_t count) { return count * sizeof(float); }

// The most samples of a level that are in bricks begun at once, as pencils come.
std::size_t open_samples(const Plan& plan, const Level& level) {
  data::Box unit;
  for (std::size_t a = 0; a < 3; ++a) unit.count[a] = std::min(plan.unit[a], plan.dims[a]);
  const data::Box all = plan.box_at(unit, level);
  const Three bricks = over(all.count, level.brick);
  const std::size_t bricks_of_pencil = static_cast<std::size_t>(bricks[0]);
  std::vector<std::size_t> missing(static_cast<std::size_t>(bricks[1]) *
                                   static_cast<std::size_t>(bricks[2]));
  std::size_t open = 0;
  std::size_t most = 0;
  for (const Reading& reading : readings(plan, unit, {0, 0})) {
    const data::Box at = plan.box_at(reading.box, level);
    for (int z = at.first[2] / level.brick[2];
         z <= (at.first[2] + at.count[2] - 1) / level.brick[2]; ++z) {
      for (int y = at.first[1] / level.brick[1];
           y <= (at.first[1] + at.count[1] - 1) / level.brick[1]; ++y) {
        const Three first{0, y * level.brick[1], z * level.brick[2]};
        std::size_t there = 1;
        std::size_t taken = 1;
        for (std::size_t a = 1; a < 3; ++a) {
          const int end = std::min(first[a] + level.brick[a], all.count[a]);
          there *= static_cast<std::size_t>(end - first[a]);
          taken *= static_cast<std::size_t>(std::min(end, at.first[a] + at.count[a]) -
                                            std::max(first[a], at.first[a]));
        }
        std::size_t& left =
            missing[static_cast<std::size_t>(z) * static_cast<std::size_t>(bricks[1]) +
                    static_cast<std::size_t>(y)];
        if (left == 0) {
          left = there;
          ++open;
        }
        most = std::max(most, open);
        left -= taken;
        if (left == 0) --open;
      }
    }
  }
  return most * bricks_of_pencil * product(level.brick);
}

class Sharing {
 public:
  Sharing(const data::DatasetInfo& info, const Plan& plan, const Options& options)
      : info_(info), plan_(plan), options_(options) {
    for (const Level& level : plan.levels) open_.push_back(open_samples(plan, level));
    for (const Level& level : plan.middles) open_middles_.push_back(open_samples(plan, level));
  }

  Result<Shares> share() {
    Shares out;
    out.loader_bytes = loader_bytes();
    const std::uint64_t limit = options_.memory_bytes;
    const std::uint64_t one = worker({0, 0}) + out.loader_bytes;
    if (program_bytes + one > limit) return too_little(program_bytes + one);
    out.workers = static_cast<unsigned>(
        std::min<std::uint64_t>(options_.threads, (limit - program_bytes) / one));
    out.workers = static_cast<unsigned>(
        std::min<std::size_t>(out.workers, std::max<std::size_t>(plan_.units.size(), 1)));
    out.workers = workers_with_files(plan_, out.workers);
    find_decoded(out);
    for (int n = 0; n < 2 * growth_max && out.decoded > 1.01; ++n) {
      Shares more = out;
      ++more.across[n % 2];
      const std::uint64_t each = worker(more.across) + out.loader_bytes;
      if (program_bytes + each * out.workers > limit) break;
      find_decoded(more);
      out = more;
    }
    return out;
  }

 private:
  [[nodiscard]] std::uint64_t loader_bytes() const {
    std::uint64_t chunk = 0;
    for (const PlannedField& field : plan_.fields) {
      chunk = std::max(chunk, info_.fields[field.index].chunk_bytes);
    }
    const std::uint64_t share =
        std::clamp(options_.memory_bytes / 8, loader_bytes_min, loader_bytes_max);
    return std::max(share, loader_bytes_min / 2 + chunks_at_a_time * chunk);
  }

  // Bytes of a worker without its loader: of the field that takes most.
  [[nodiscard]] std::uint64_t worker(const std::array<int, 2>& across) const {
    std::uint64_t most = 0;
    for (const PlannedField& field : plan_.fields) most = std::max(most, bytes_of(field, across));
    return most + worker_bytes;
  }

  [[nodiscard]] std::uint64_t bytes_of(const PlannedField& field,
                                       const std::array<int, 2>& across) const {
    const auto components = static_cast<std::size_t>(field.components);
    Three read = plan_.pencil;
    for (std::size_t a = 0; a < 3; ++a) {
      const int n = a == 0 ? 1 : 1 << across[a - 1];
      read[a] = std::min({read[a] * n, plan_.unit[a], plan_.dims[a]});
    }
    Three pencil{};
    for (std::size_t a = 0; a < 3; ++a) pencil[a] = std::min(plan_.pencil[a], plan_.dims[a]);
    std::uint64_t bytes = floats(product(read) * components);
    if (!info_.fields[field.index].is_read_by_boxes()) {
      bytes = floats(product(plan_.dims) * components);
    } else if (bytes <= transfer_bytes_max) {
      bytes *= 2;
    }
    if (read != pencil || !info_.fields[field.index].is_read_by_boxes()) {
      bytes += floats(product(pencil) * components);
    }
    // A brick, padded, and compressed.
    bytes += 3 * floats(product(plan_.levels[0].brick) * components);
    std::uint64_t reduced = 0;  // one at a time
    for (const Product& made : field.products) {
      if (made.level == 0) continue;
      const Level& level = plan_.level_of(made);
      const auto& open = made.as == Reduced::strided ? open_middles_ : open_;
      Three groups{};
      for (std::size_t a = 0; a < 3; ++a) groups[a] = over(pencil[a], 1 << level.how.halvings[a]);
      reduced = std::max(reduced, floats(product(groups) * made.arrays.size()));
      const std::size_t samples =
          level.by_unit ? open[made.level] : product(over(plan_.unit, group_of(level)));
      bytes += floats(samples * made.arrays.size());
    }
    const Three bricks = over(plan_.unit, plan_.levels[0].brick);
    return bytes + reduced + floats(product(bricks) * (3 + histogram_bins));
  }

  [[nodiscard]] static Three group_of(const Level& level) {
    return {1 << level.how.halvings[0], 1 << level.how.halvings[1], 1 << level.how.halvings[2]};
  }

  // How often the samples of a step are decoded.
  void find_decoded(Shares& shares) const {
    shares.decoded = 1;
    for (std::size_t f = 0; f < plan_.fields.size(); ++f) {
      const data::FieldInfo& field = info_.fields[plan_.fields[f].index];
      if (!field.is_read_by_boxes()) continue;
      double decoded = 0;
      for (const Unit& unit : plan_.units) {
        if (unit.field != f || unit.step != 0) continue;
        for (const Reading& reading : readings(plan_, plan_.box_of(unit), shares.across)) {
          decoded += decoded_share(reading.box, 1, field, plan_.dims);
        }
      }
      if (decoded <= shares.decoded) continue;
      shares.decoded = decoded;
      shares.decoded_field = field.name;
    }
  }

  [[nodiscard]] Error too_little(std::uint64_t bytes) const {
    const std::uint64_t whole = (bytes + mebi - 1) / mebi * mebi;
    std::string why;
    for (const PlannedField& field : plan_.fields) {
      const data::FieldInfo& about = info_.fields[field.index];
      if (about.is_read_by_boxes() || floats(product(plan_.dims)) < 64 * mebi) continue;
      why = "; " + in_quotes(about.name) + " is only read as a whole";
      break;
    }
    return make_error(ErrorKind::out_of_memory, options_.memory_text(options_.memory_bytes) +
                                                    " is too little for one worker; " +
                                                    options_.memory_text(whole) + " would suffice" +
                                                    why);
  }

  const data::DatasetInfo& info_;
  const Plan& plan_;
  const Options& options_;
  std::vector<std::size_t> open_, open_middles_;  // samples in open bricks, by level
};

}  // namespace

Result<Shares> share_memory(const data::DatasetInfo& info, const Plan& plan,
                            const Options& options) {
  return Sharing(info, plan, options).share();
}

}  // namespace windsplat::convert
