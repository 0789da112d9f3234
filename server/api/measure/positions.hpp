// Positions of queries: indices or coordinates -> a sample of a dataset, and its description.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/measurements.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/model/measure.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/http/request_target.hpp"
#include "server/tasks/catalogue.hpp"

namespace windsplat::api {

// A position, whose z is an absolute height if `height_field` names a field of heights; or the
// indices of a sample.
struct Position {
  std::array<std::optional<double>, 3> at;
  std::optional<std::array<int, 3>> index;
  std::optional<std::string> height_field;
};

// The parameters x, y, z or lon, lat, level; or index. Errors: malformed or invalid, also lon and
// lat of data without them; those of other parameters remain in the query.
Result<Position> read_position(http::QueryReader& query, const data::Grid& grid);

// Whether every column has a longitude and a latitude in degrees.
bool is_geographic(const data::Grid& grid);

struct Located {
  data::Place place;
  protocol::PositionDescription position;
};

// A sample at its coordinates, for columns at longitude and latitude.
protocol::PositionDescription position_of(const data::Grid& grid, const std::array<int, 3>& index);

// Loads the height field, if there is one. Errors: those of loading; invalid (outside the grid, no
// such field, no heights as geometry.heightField takes them).
Result<Located> locate(tasks::Catalogue& catalogue, const data::Dataset& dataset,
                       const Position& position, const CancelToken& cancel);

// A field near a sample: the samples of a box that it lies in, or all of them, where the box costs
// hardly less to read or all are in memory.
struct Nearby {
  std::shared_ptr<const data::Volume> volume;
  std::array<int, 3> first{0, 0, 0};  // the index of the first sample
  // The components at the sample; empty if it is masked.
  [[nodiscard]] std::optional<std::vector<double>> value_at(const std::array<int, 3>& index) const;
};
// Errors: those of load_field().
Result<Nearby> load_nearby(tasks::Catalogue& catalogue, const data::Dataset& dataset,
                           const std::string& field, std::size_t step,
                           const std::array<int, 3>& index, const CancelToken& cancel);

// The samples of a box alone (Dataset::part()). Errors: those of load_field().
Result<std::shared_ptr<const data::Volume>> load_part(tasks::Catalogue& catalogue,
                                                      const data::Dataset& dataset,
                                                      const std::string& field, std::size_t step,
                                                      const data::Box& box,
                                                      const CancelToken& cancel);

// A field at a step. Errors: those of loading, with the names of dataset and field.
Result<std::shared_ptr<const data::Volume>> load_field(tasks::Catalogue& catalogue,
                                                       const data::Dataset& dataset,
                                                       const std::string& field, std::size_t step,
                                                       const CancelToken& cancel);

}  // namespace windsplat::api
