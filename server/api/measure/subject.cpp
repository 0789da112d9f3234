#include "server/api/measure/subject.hpp"

#include <utility>

#include "protocol/view.hpp"
#include "server/api/measure/positions.hpp"
#include "server/api/operations/parameters.hpp"
#include "server/api/step_of_time.hpp"

namespace windsplat::api {

Result<DatasetPtr> find_dataset(const tasks::Catalogue& catalogue, const std::string& id,
                                http::QueryReader& query) {
  auto dataset = catalogue.find(id);
  if (!dataset) return make_error(ErrorKind::not_found, dataset.error().message);
  const auto minus = read_text(query, parameters::minus);
  const auto step = read_integer(query, parameters::minus_step);
  if (!minus && !step) return dataset;
  protocol::View view;
  view.dataset = id;
  view.difference = protocol::DifferenceView{minus, step};
  auto shown = tasks::find_shown(catalogue, view);
  if (shown) return shown;
  const Error& error = shown.error();
  return make_error(error.kind, "query parameters 'minus' and 'minusStep': " +
                                    (error.at.empty() ? error.message : error.at.front().detail));
}

Result<Subject> find_subject(tasks::Catalogue& catalogue, const std::string& id,
                             const std::string& field, const http::Request& request,
                             http::QueryReader& query) {
  auto dataset = find_dataset(catalogue, id, query);
  if (!dataset) return dataset.error();
  const data::FieldInfo* found = (*dataset)->info().find(field);
  if (found == nullptr) {
    return make_error(ErrorKind::not_found, "dataset '" + printable(id) + "' has no field '" +
                                                printable(field) + "'" +
                                                data::absence_text((*dataset)->info(), field));
  }
  return Subject{&catalogue, std::move(*dataset), *found, request.cancel};
}

Result<std::shared_ptr<const data::Volume>> load(const Subject& subject, std::size_t step) {
  return load_field(*subject.catalogue, *subject.dataset, subject.field.name, step, subject.cancel);
}

Result<std::size_t> read_step(http::QueryReader& query, const data::Dataset& dataset) {
  const data::DatasetInfo& info = dataset.info();
  const auto number =
      read_integer(query, parameters::step, static_cast<int>(info.steps.size()) - 1);
  const auto of_time = step_of(read_time(query), number.has_value(), info);
  if (!of_time) return of_time.error();
  return of_time->value_or(static_cast<std::size_t>(number.value_or(0)));
}

protocol::ProbedField probed_field(const data::FieldInfo& field) {
  return {field.name, field.kind == data::FieldKind::vector, field.units, field.component_units};
}

}  // namespace windsplat::api
