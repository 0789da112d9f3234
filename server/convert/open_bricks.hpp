// The bricks of a level that pencils have begun and not completed.
#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "server/base/error.hpp"
#include "server/convert/plan.hpp"
#include "server/data/formats/zarr/write/shard_writer.hpp"

namespace windsplat::convert {

// The region of a unit at a level, the arrays of a product in it.
class OpenBricks {
 public:
  // `box`: of the unit at this level; `writers`: of the arrays.
  OpenBricks(const Level& level, const data::Box& box,
             std::vector<data::zarr::ShardWriter*> writers);

  // Takes samples of an array; those of each box once for every array. Bricks that are complete are
  // appended to the shards, of equal calls in equal order. Errors: those of ShardWriter::add().
  Result<void> put(std::size_t array, const data::Box& box, const float* values);

 private:
  struct Brick {
    std::vector<float> values;  // of all arrays
    std::size_t missing = 0;
  };
  // Memory for all arrays of a brick, of which so many samples are in the data.
  std::vector<float> room_for(const Three& there);
  Result<void> put_into(const Three& brick, std::size_t array, const data::Box& box,
                        const float* values);

  const Level& level_;
  data::Box box_;
  std::vector<data::zarr::ShardWriter*> writers_;
  std::map<std::size_t, Brick> open_;      // by number in the region
  std::vector<std::vector<float>> spare_;  // of bricks that were complete
};

// The number of a brick in its region of a shard, and the region's place along t, z, y, x.
std::size_t number_in_region(const Level& level, const Three& brick);
std::vector<std::size_t> region_place(const Level& level, std::size_t step, const Three& sample);

}  // namespace windsplat::convert
