// What a query measures: dataset and field, resolved before anything is loaded.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "protocol/measurements.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/http/exchange.hpp"
#include "server/http/request_target.hpp"
#include "server/tasks/catalogue.hpp"

namespace windsplat::api {

using DatasetPtr = std::shared_ptr<data::Dataset>;

struct Subject {
  tasks::Catalogue* catalogue = nullptr;
  DatasetPtr dataset;
  data::FieldInfo field;
  CancelToken cancel;
};

// With `minus` and `minusStep` of the query the differences from that dataset or step, as those of
// a view. Errors: not_found, invalid (grids, steps).
Result<DatasetPtr> find_dataset(const tasks::Catalogue& catalogue, const std::string& id,
                                http::QueryReader& query);
// The same with a field. Errors: not_found for it, too.
Result<Subject> find_subject(tasks::Catalogue& catalogue, const std::string& id,
                             const std::string& field, const http::Request& request,
                             http::QueryReader& query);

Result<std::shared_ptr<const data::Volume>> load(const Subject& subject, std::size_t step);
// The step that a query asks for, by `step` or `datetime`; the first without both. Errors: those of
// step_of(), which count after those of QueryReader::finish().
Result<std::size_t> read_step(http::QueryReader& query, const data::Dataset& dataset);
protocol::ProbedField probed_field(const data::FieldInfo& field);

}  // namespace windsplat::api
