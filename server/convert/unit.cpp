#include "server/convert/unit.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/whole_file.hpp"
#include "server/convert/open_bricks.hpp"

namespace windsplat::convert {

using data::zarr::ShardWriter;

Result<data::Volume> Reader::read(std::size_t field, std::size_t step, const data::Box& box) {
  if (source_.info().fields.at(field).is_read_by_boxes()) {
    return source_.read_part(field, step, {box});
  }
  if (!whole_ || field_ != field || step_ != step) {
    whole_.reset();
    auto volume = source_.read(field, step);
    if (!volume) return volume.error();
    whole_ = std::make_unique<const data::Volume>(std::move(*volume));
    field_ = field;
    step_ = step;
  }
  return cut(*whole_, box);
}

Kept::Kept(const Plan& plan, const PlannedField& field, const data::Box& unit)
    : bricks_(over(unit.count, plan.levels[0].brick)) {
  bytes_ = product(bricks_) * bytes_of_brick();
  for (const Product& made : field.products) {
    const Level& level = plan.level_of(made);
    if (level.by_unit) continue;
    const data::Box box = plan.box_at(unit, level);
    for (const std::size_t array : made.arrays) {
      pieces_.push_back({array, box, bytes_});
      bytes_ += product(box.count) * sizeof(float);
    }
  }
}

std::size_t Kept::bytes_of_brick() {
  return 2 * sizeof(float) + (1 + histogram_bins) * sizeof(std::uint32_t);
}

std::filesystem::path kept_path(const std::filesystem::path& store, std::size_t unit) {
  return store / ".coarse" / std::to_string(unit);
}

namespace {

class UnitMaker {
 public:
  UnitMaker(const Plan& plan, std::size_t number, const std::filesystem::path& store)
      : plan_(plan),
        store_(store),
        unit_(plan.units[number]),
        field_(plan.fields[unit_.field]),
        box_(plan.box_of(unit_)),
        kept_(plan, field_, box_),
        number_(number),
        statistics_(product(kept_.bricks())),
        coarse_((kept_.bytes() - product(kept_.bricks()) * Kept::bytes_of_brick()) /
                sizeof(float)) {
    open_.resize(field_.products.size());
    for (std::size_t p = 0; p < open_.size(); ++p) {
      const Product& made = field_.products[p];
      const Level& level = plan_.level_of(made);
      if (!level.by_unit) continue;
      const data::Box at = plan_.box_at(box_, level);
      std::vector<ShardWriter*> writers;
      for (const std::size_t array : made.arrays) {
        ShardWriter writer(store_, plan_.arrays[array], region_place(level, unit_.step, at.first));
        writers.push_back(&writers_.emplace(array, std::move(writer)).first->second);
      }
      if (made.level > 0) open_[p].emplace(level, at, std::move(writers));
    }
  }

  Result<void> add(const data::Volume& pencil, const data::Box& box) {
    if (auto done = add_bricks(pencil, box); !done) return done;
    for (std::size_t p = 0; p < open_.size(); ++p) {
      const Product& made = field_.products[p];
      if (made.level == 0) continue;
      const Level& level = plan_.level_of(made);
      const data::Volume reduced = reduce(plan_, made, pencil, box);
      const data::Box at = plan_.box_at(box, level);
      for (std::size_t n = 0; n < made.arrays.size(); ++n) {
        const float* const values = reduced.component(static_cast<int>(n));
        if (level.by_unit) {
          auto done = open_[p]->put(n, at, values);
          if (!done) return done;
        } else {
          keep(made.arrays[n], at, values);
        }
      }
    }
    return {};
  }

  Result<UnitFiles> close() {
    UnitFiles out;
    for (auto& [array, writer] : writers_) {
      auto files = writer.close();
      if (!files) return files.error();
      out.files.insert(out.files.end(), files->begin(), files->end());
    }
    std::string bytes;
    const auto append = [&](const auto& numbers) {
      bytes.append(reinterpret_cast<const char*>(numbers.data()),
                   numbers.size() * sizeof numbers[0]);
    };
    append(statistics_.low);
    append(statistics_.high);
    append(statistics_.masked);
    append(statistics_.histogram);
    append(coarse_);
    if (auto done = write_whole_file(kept_path(store_, number_), bytes, Sync::now); !done) {
      return done.error();
    }
    out.kept_bytes = bytes.size();
    return out;
  }

 private:
  // The bricks of level 0 and their statistics.
  Result<void> add_bricks(const data::Volume& pencil, const data::Box& box) {
    const Level& level = plan_.levels[0];
    const Three along = over(box.count, level.brick);
    std::vector<std::array<int, 2>> order;
    for (int z = 0; z < along[2]; ++z) {
      for (int y = 0; y < along[1]; ++y) order.push_back({y, z});
    }
    std::ranges::sort(order, {}, [](const std::array<int, 2>& at) {
      return morton(static_cast<std::uint32_t>(at[0]), static_cast<std::uint32_t>(at[1]));
    });
    for (const auto& [y, z] : order) {
      for (int x = 0; x < along[0]; ++x) {
        if (auto done = add_brick(pencil, box, {x, y, z}); !done) return done;
      }
    }
    return {};
  }

  Result<void> add_brick(const data::Volume& pencil, const data::Box& box, const Three& at) {
    const Level& level = plan_.levels[0];
    data::Box in_pencil;
    data::Box room;
    Three brick{};
    Three in_unit{};
    for (std::size_t a = 0; a < 3; ++a) {
      in_pencil.first[a] = at[a] * level.brick[a];
      in_pencil.count[a] = std::min(level.brick[a], box.count[a] - in_pencil.first[a]);
      room.count[a] = level.brick[a];
      brick[a] = (box.first[a] + in_pencil.first[a]) / level.brick[a];
      in_unit[a] = (box.first[a] + in_pencil.first[a] - box_.first[a]) / level.brick[a];
    }
    const data::Volume& values = brick_of(pencil, in_pencil);
    statistics_.set(flat(in_unit, kept_.bricks()), statistics_of(values));
    const std::size_t number = number_in_region(level, brick);
    const Product& samples = field_.products.front();
    for (std::size_t c = 0; c < samples.arrays.size(); ++c) {
      const float* items = values.component(static_cast<int>(c));
      if (in_pencil.count != level.brick) {
        padded_.assign(product(level.brick), std::numeric_limits<float>::quiet_NaN());
        copy_common(items, {{0, 0, 0}, in_pencil.count}, room, padded_.data());
        items = padded_.data();
      }
      auto done = writers_.at(samples.arrays[c]).add(number, {items, product(level.brick)});
      if (!done) return done;
    }
    return {};
  }

  // The samples of a box of a pencil, in memory that is used again.
  const data::Volume& brick_of(const data::Volume& pencil, const data::Box& box) {
    const std::size_t samples = box.samples();
    const std::size_t count = samples * static_cast<std::size_t>(pencil.components);
    if (brick_.values.size() != count) brick_.values = data::Samples(count);
    brick_.dims = box.count;
    brick_.components = pencil.components;
    for (int c = 0; c < pencil.components; ++c) {
      copy_common(pencil.component(c), {{0, 0, 0}, pencil.dims}, box,
                  brick_.values.data() + static_cast<std::size_t>(c) * samples);
    }
    WINDSPLAT_CHECK(measure_volume(brick_));  // as the pencil is masked
    return brick_;
  }

  void keep(std::size_t array, const data::Box& box, const float* values) {
    const auto piece = std::ranges::find(kept_.pieces(), array, &Kept::Piece::array);
    const std::size_t before = product(kept_.bricks()) * Kept::bytes_of_brick();
    float* const to = coarse_.data() + (piece->offset - before) / sizeof(float);
    copy_common(values, box, piece->box, to);
  }

  const Plan& plan_;
  const std::filesystem::path& store_;
  const Unit& unit_;
  const PlannedField& field_;
  const data::Box box_;
  const Kept kept_;
  const std::size_t number_;
  Statistics statistics_;
  std::vector<float> coarse_;
  std::map<std::size_t, ShardWriter> writers_;   // by array
  std::vector<std::optional<OpenBricks>> open_;  // by product
  std::vector<float> padded_;
  data::Volume brick_;
};

}  // namespace

Result<UnitFiles> make_unit(const Plan& plan, std::size_t number,
                            const std::filesystem::path& store, Reader& reader,
                            const std::array<int, 2>& across, const CancelToken& cancel) {
  const Unit& unit = plan.units[number];
  const std::size_t field = plan.fields[unit.field].index;
  UnitMaker maker(plan, number, store);
  for (const Reading& reading : readings(plan, plan.box_of(unit), across)) {
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "interrupted");
    const auto volume = reader.read(field, plan.steps[unit.step], reading.box);
    if (!volume) return volume.error();
    for (const data::Box& pencil : reading.pencils) {
      if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "interrupted");
      if (reading.pencils.size() == 1) {
        if (auto done = maker.add(*volume, pencil); !done) return done.error();
        continue;
      }
      data::Box within = pencil;
      for (std::size_t a = 0; a < 3; ++a) within.first[a] -= reading.box.first[a];
      if (auto done = maker.add(cut(*volume, within), pencil); !done) return done.error();
    }
  }
  return maker.close();
}

}  // namespace windsplat::convert
