#include "protocol/view/codec_seeds.hpp"

#include <cmath>
#include <cstddef>

#include "protocol/limits.hpp"

namespace windsplat::protocol {

namespace {

constexpr NumberRange coordinate{-limits::coordinate_max, limits::coordinate_max};
constexpr std::size_t points_max = 1000;

std::vector<Vec3> read_points(const Json& json, const std::string& pointer, Faults& faults) {
  std::vector<Vec3> points;
  if (!json.is_array() || json.size() > points_max) {
    faults.add(pointer,
               "must be an array of at most " + std::to_string(points_max) + " points, not " +
                   (json.is_array() ? "of " + std::to_string(json.size()) : described(json)));
    return points;
  }
  for (std::size_t n = 0; n < json.size(); ++n) {
    const std::string at = join_pointer(pointer, n);
    if (!json[n].is_array() || json[n].size() != 3) {
      faults.add(at, "must be an array of 3 numbers, not " + described(json[n]));
      continue;
    }
    Vec3 point{};
    for (std::size_t a = 0; a < 3; ++a) {
      if (const auto read = read_number(json[n][a], join_pointer(at, a), coordinate, faults)) {
        point[a] = *read;
      }
    }
    points.push_back(point);
  }
  return points;
}

// The ends of a line or block.
template <class Ends>
void read_ends(ObjectReader& reader, Ends& out) {
  reader.child("from", Presence::required);
  reader.child("to", Presence::required);
  reader.numbers("from", out.from, coordinate);
  reader.numbers("to", out.to, coordinate);
}

SeedLineView read_line(const Json& json, const std::string& pointer, Faults& faults) {
  SeedLineView line;
  ObjectReader reader(json, pointer, faults);
  read_ends(reader, line);
  reader.integer("count", line.count, {1, limits::seeds_max});
  reader.finish();
  return line;
}

SeedBlockView read_block(const Json& json, const std::string& pointer, Faults& faults) {
  SeedBlockView block;
  ObjectReader reader(json, pointer, faults);
  read_ends(reader, block);
  Vec3 counts{};
  for (std::size_t a = 0; a < 3; ++a) counts[a] = block.counts[a];
  reader.numbers("counts", counts, {1, limits::seeds_max});
  for (std::size_t a = 0; a < 3; ++a) {
    if (std::trunc(counts[a]) != counts[a]) {
      faults.add(join_pointer(reader.at("counts"), a),
                 "must be a whole number, not " + dump(canonical_number(counts[a])));
    }
    block.counts[a] = static_cast<int>(counts[a]);
  }
  reader.finish();
  return block;
}

Json json_of(const Vec3& numbers) { return numbers_json({numbers.begin(), numbers.end()}); }

}  // namespace

SeedsView read_seeds(const Json& json, const std::string& pointer, Faults& faults) {
  SeedsView seeds;
  ObjectReader reader(json, pointer, faults);
  reader.integer("evenly", seeds.evenly, {0, limits::seeds_max});
  if (const Json* points = reader.child("points")) {
    seeds.points = read_points(*points, reader.at("points"), faults);
  }
  if (const Json* line = reader.child("line", Presence::optional, Null::is_default)) {
    seeds.line = read_line(*line, reader.at("line"), faults);
  }
  if (const Json* block = reader.child("block", Presence::optional, Null::is_default)) {
    seeds.block = read_block(*block, reader.at("block"), faults);
  }
  reader.number("length", seeds.length, {0, limits::seed_length_max});
  reader.number("duration", seeds.duration, {0, limits::coordinate_max});
  reader.integer("pathSteps", seeds.path_steps, {0, limits::path_steps_max});
  reader.integer("pieces", seeds.pieces, {1, limits::pieces_max});
  reader.number("dash", seeds.dash, {limits::dash_min, limits::dash_max});
  reader.finish();
  return seeds;
}

Json seeds_to_json(const SeedsView& seeds) {
  Json points = Json::array();
  for (const Vec3& point : seeds.points) points.push_back(json_of(point));
  Json line;
  if (seeds.line) {
    line = {{"from", json_of(seeds.line->from)},
            {"to", json_of(seeds.line->to)},
            {"count", seeds.line->count}};
  }
  Json block;
  if (seeds.block) {
    block = {{"from", json_of(seeds.block->from)},
             {"to", json_of(seeds.block->to)},
             {"counts", seeds.block->counts}};
  }
  return {{"evenly", seeds.evenly ? Json(*seeds.evenly) : Json(nullptr)},
          {"points", std::move(points)},
          {"line", std::move(line)},
          {"block", std::move(block)},
          {"length", number_or_null(seeds.length)},
          {"duration", number_or_null(seeds.duration)},
          {"pathSteps", seeds.path_steps},
          {"pieces", seeds.pieces},
          {"dash", canonical_number(seeds.dash)}};
}

}  // namespace windsplat::protocol
