// A unit: pencils of a field at a step in, the shards of its region and what later parts of the
// conversion need of it out.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/convert/pencil.hpp"
#include "server/convert/plan.hpp"
#include "server/data/formats/zarr/write/shard_writer.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::convert {

// Reads the boxes of a field, of one that is only read as a whole once for all of them.
class Reader {
 public:
  explicit Reader(data::Source& source) : source_(source) {}
  Result<data::Volume> read(std::size_t field, std::size_t step, const data::Box& box);

 private:
  data::Source& source_;
  std::size_t field_ = 0, step_ = 0;
  std::unique_ptr<const data::Volume> whole_;
};

// What a unit keeps for the end: the statistics of its bricks, and its samples of the levels that
// are not made by unit.
class Kept {
 public:
  Kept(const Plan& plan, const PlannedField& field, const data::Box& unit);

  // Of an array of a level: its place in floats, and the box.
  struct Piece {
    std::size_t array = 0;
    data::Box box;
    std::size_t offset = 0;  // bytes
  };
  [[nodiscard]] const std::vector<Piece>& pieces() const { return pieces_; }
  // The bricks of level 0: x fastest.
  [[nodiscard]] const Three& bricks() const { return bricks_; }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] static std::size_t bytes_of_brick();

 private:
  Three bricks_{};
  std::vector<Piece> pieces_;
  std::size_t bytes_ = 0;
};

// The file of what is kept of a unit.
std::filesystem::path kept_path(const std::filesystem::path& store, std::size_t unit);

struct UnitFiles {
  std::vector<data::zarr::WrittenFile> files;  // of the store
  std::size_t kept_bytes = 0;
};

// Makes a unit. across: as of readings(). Errors: cancelled; those of reading and writing.
Result<UnitFiles> make_unit(const Plan& plan, std::size_t number,
                            const std::filesystem::path& store, Reader& reader,
                            const std::array<int, 2>& across, const CancelToken& cancel);

}  // namespace windsplat::convert
