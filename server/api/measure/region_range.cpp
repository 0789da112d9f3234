// The range of a field in the region of a view, with the samples of its ends.
#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "protocol/measurements.hpp"
#include "server/api/measure/positions.hpp"
#include "server/api/resources.hpp"
#include "server/data/model/measure.hpp"
#include "server/http/problem.hpp"
#include "server/scene/place.hpp"
#include "server/scene/region/crop.hpp"

namespace windsplat::api {
namespace {

struct Asked {
  data::FieldInfo field;
  protocol::View view;
};

// Indices of the part -> those of the data.
std::array<int, 3> in_the_data(std::array<int, 3> index, const scene::Placed& placed) {
  const scene::Lattice& lattice = placed.lattice;
  for (std::size_t a = 0; a < 3; ++a) index.at(a) += lattice.first.at(a);
  if (lattice.turn > 0) index[0] %= lattice.turn;
  return index;
}

Result<protocol::RangeDescription> range_of(const Asked& asked, data::Dataset& dataset) {
  const protocol::View& view = asked.view;
  const auto placed = scene::place_dataset(view.geometry, dataset, view.region);
  if (!placed) return placed.error();
  const bool is_vector = asked.field.kind == data::FieldKind::vector;
  const auto filters = scene::filters_of(
      view.region, is_vector ? protocol::FilterOf::lines : protocol::FilterOf::media);
  const auto part = scene::kept_part(**placed, asked.field.components.size(), filters);
  const auto volume = dataset.derived(asked.field.name, static_cast<std::size_t>(view.step), part);
  if (!volume) return volume.error();
  data::FieldRange range;
  range.add(**volume);
  protocol::RangeDescription out{range.range, range.masked, "step", {}};
  if (const auto places = data::extremes(**volume)) {
    const data::Grid& grid = dataset.info().grid;
    out.places = {position_of(grid, in_the_data(places->least, **placed)),
                  position_of(grid, in_the_data(places->greatest, **placed))};
  }
  return out;
}

}  // namespace

void post_range(tasks::Backend& backend, const std::string& id, const std::string& field,
                const http::Request& request, http::Reply reply) {
  const auto refuse = [&](const Error& error) { reply(http::problem_response(error)); };
  if (!is_json(request.header("Content-Type"))) {
    reply(http::problem_response(415, "Unsupported Media Type",
                                 "Content-Type must be application/json"));
    return;
  }
  const auto found = backend.catalogue.find(id);
  if (!found) return refuse(make_error(ErrorKind::not_found, found.error().message));
  const data::DatasetInfo& info = (*found)->info();
  const data::FieldInfo* const known = info.find(field);
  if (known == nullptr) {
    return refuse(make_error(ErrorKind::not_found, "dataset '" + printable(id) +
                                                       "' has no field '" + printable(field) + "'" +
                                                       data::absence_text(info, field)));
  }
  const auto document = protocol::ViewDocument::parse(request.body);
  if (!document) return refuse(document.error());
  Asked asked{*known, document->view()};
  asked.view.dataset = id;
  asked.view.quality = {};
  if (const auto drawable = backend.check(asked.view); !drawable) return refuse(drawable.error());
  const auto shown = tasks::find_shown(backend.catalogue, asked.view);
  if (!shown) return refuse(shown.error());
  run_later(backend.loads, request, std::move(reply), "a range", shown->get(),
            [&backend, asked = std::move(asked), dataset = *shown, cancel = request.cancel] {
              const auto range = backend.catalogue.load(
                  *dataset, [&](data::Dataset& loading) { return range_of(asked, loading); },
                  cancel);
              return range ? json_response(protocol::encode_range(*range))
                           : http::problem_response(range.error());
            });
}

}  // namespace windsplat::api
