#include "server/convert/open_bricks.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "server/convert/pencil.hpp"

namespace windsplat::convert {

OpenBricks::OpenBricks(const Level& level, const data::Box& box,
                       std::vector<data::zarr::ShardWriter*> writers)
    : level_(level), box_(box), writers_(std::move(writers)) {}

Result<void> OpenBricks::put(std::size_t array, const data::Box& box, const float* values) {
  Three first{};
  Three last{};
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = box.first[a] / level_.brick[a];
    last[a] = (box.first[a] + box.count[a] - 1) / level_.brick[a];
  }
  for (int z = first[2]; z <= last[2]; ++z) {
    for (int y = first[1]; y <= last[1]; ++y) {
      for (int x = first[0]; x <= last[0]; ++x) {
        if (auto done = put_into({x, y, z}, array, box, values); !done) return done;
      }
    }
  }
  return {};
}

std::vector<float> OpenBricks::room_for(const Three& there) {
  constexpr float absent = std::numeric_limits<float>::quiet_NaN();
  const std::size_t count = product(level_.brick) * writers_.size();
  if (spare_.empty()) return std::vector<float>(count, absent);
  std::vector<float> out = std::move(spare_.back());
  spare_.pop_back();
  if (there != level_.brick) std::fill(out.begin(), out.end(), absent);
  return out;
}

Result<void> OpenBricks::put_into(const Three& at, std::size_t array, const data::Box& box,
                                  const float* values) {
  data::Box room;  // beyond the data too
  Three there{};   // samples of it
  Three taken{};
  for (std::size_t a = 0; a < 3; ++a) {
    room.first[a] = at[a] * level_.brick[a];
    room.count[a] = level_.brick[a];
    const int end = std::min(room.first[a] + room.count[a], box_.first[a] + box_.count[a]);
    there[a] = end - room.first[a];
    taken[a] = std::min(end, box.first[a] + box.count[a]) - std::max(room.first[a], box.first[a]);
  }
  const std::size_t samples = product(level_.brick);
  const std::size_t number = number_in_region(level_, at);
  auto found = open_.find(number);
  if (found == open_.end()) {
    Brick made{room_for(there), product(there) * writers_.size()};
    found = open_.emplace(number, std::move(made)).first;
  }
  Brick& brick = found->second;
  copy_common(values, box, room, brick.values.data() + array * samples);
  brick.missing -= product(taken);
  if (brick.missing > 0) return {};
  for (std::size_t n = 0; n < writers_.size(); ++n) {
    const std::span<const float> items(brick.values.data() + n * samples, samples);
    if (auto done = writers_[n]->add(number, items); !done) return done;
  }
  spare_.push_back(std::move(brick.values));
  open_.erase(found);
  return {};
}

std::size_t number_in_region(const Level& level, const Three& brick) {
  const Three bricks = over(level.region, level.brick);
  return flat({brick[0] % bricks[0], brick[1] % bricks[1], brick[2] % bricks[2]}, bricks);
}

std::vector<std::size_t> region_place(const Level& level, std::size_t step, const Three& sample) {
  std::vector<std::size_t> out{step};
  for (std::size_t a = 3; a-- > 0;) {
    out.push_back(static_cast<std::size_t>(sample[a] / level.region[a]));
  }
  return out;
}

}  // namespace windsplat::convert
