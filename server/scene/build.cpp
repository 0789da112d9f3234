#include "server/scene/build.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "protocol/view/shown.hpp"
#include "server/light/lit_scene.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/colormap.hpp"
#include "server/scene/detail.hpp"
#include "server/scene/earth/ground.hpp"
#include "server/scene/level/choice.hpp"
#include "server/scene/lines/mark.hpp"
#include "server/scene/rates.hpp"
#include "server/scene/region/crop.hpp"
#include "server/scene/region/select.hpp"
#include "server/scene/section.hpp"
#include "server/scene/surfaces/make_surfaces.hpp"
#include "server/scene/traced/streamlets.hpp"

namespace windsplat::scene {

namespace {

using protocol::absorbs;
using protocol::is_drawn_in_full;
using protocol::is_section;
using protocol::shows_lines;
using protocol::View;

constexpr int table_entries = 256;

// A reversed range reverses the colour map.
ColorTable make_table(const std::string& map, const protocol::Range& range) {
  ColorTable table;
  table.range = range;
  table.entries = color_map_linear(map, table_entries);
  if (range[0] > range[1]) {
    std::swap(table.range[0], table.range[1]);
    std::reverse(table.entries.begin(), table.entries.end());
  }
  return table;
}

LineColor line_color(protocol::ColorBy by) {
  switch (by) {
    case protocol::ColorBy::world_z:
      return LineColor::world_z;
    case protocol::ColorBy::screen_z:
      return LineColor::screen_z;
    case protocol::ColorBy::rise:
      return LineColor::rise;
    case protocol::ColorBy::magnitude:
      return LineColor::magnitude;
    case protocol::ColorBy::direction:
      return LineColor::direction;
    case protocol::ColorBy::scalar:
      return LineColor::scalar;
    case protocol::ColorBy::constant:
      return LineColor::constant;
  }
  return LineColor::constant;
}

Method engine_method(protocol::MethodName name) {
  switch (name) {
    case protocol::MethodName::kernel:
      return Method::kernel;
    case protocol::MethodName::slab:
      return Method::slab;
    case protocol::MethodName::reference:
      return Method::reference;
  }
  return Method::kernel;
}

Compositing engine_compositing(protocol::Compositing compositing) {
  switch (compositing) {
    case protocol::Compositing::simple:
      return Compositing::simple;
    case protocol::Compositing::cd_naive:
      return Compositing::cd_naive;
    case protocol::Compositing::cd:
      return Compositing::cd;
    case protocol::Compositing::analytic:
      return Compositing::analytic;
    case protocol::Compositing::cd_euler:
      return Compositing::cd_euler;
  }
  return Compositing::analytic;
}

void set_colors(const protocol::VectorView& from, VectorLayer& layer) {
  layer.color_by = line_color(from.color.by.value());
  layer.color = make_table(from.color.map, from.color.range.value());
  if (layer.color_by == LineColor::constant) {
    layer.color.range = {0, 1};
    layer.color.entries.assign(table_entries, parse_color(from.color.constant).value());
  }
  layer.rise_weight = from.color.rise_weight;
  // A comet keeps the hue of the map.
  const bool hued = from.color.true_colors || from.mark.shape == protocol::MarkShape::comet;
  layer.head_desaturation = hued ? 0 : from.head_desaturation.value();
  layer.magnitude_range = from.magnitude_range.value();
  layer.min_magnitude = from.min_magnitude.value();
  layer.magnitude_intensity = from.color.true_colors ? 0 : from.magnitude_intensity;
}

// Fields of the level or section that is rendered. Media have two values per sample. Lines are
// those of samples, and so is the scalar that colours them: the mean of vectors that differ is
// shorter than each of them, and would be held against a least magnitude of the samples.
struct Fields {
  const data::Dataset& dataset;
  const CompletedView& completed;
  data::Coarsening coarsening;
  std::optional<data::HeldPart> part;  // of the samples of the level; nullopt: all
  const Section* section;              // null: the samples of the data
  [[nodiscard]] Needed of_medium(const std::string& name) const {
    return find({name, coarsening}, kept_of(name, protocol::FilterOf::media));
  }
  // Of the lines, or what colours them.
  [[nodiscard]] Needed of_lines(const ShownField& shown) const {
    return find(shown, kept_of(shown.field, protocol::FilterOf::lines));
  }
  // Samples of the data without those that the region leaves out.
  [[nodiscard]] data::Derivation kept_of(const std::string& name, protocol::FilterOf of) const {
    return kept_part(*completed.placed(), components_of(name),
                     filters_of(completed.view().region, of));
  }

 private:
  [[nodiscard]] std::size_t components_of(const std::string& name) const {
    return dataset.info().find(name)->components.size();
  }
  [[nodiscard]] Needed find(const ShownField& shown, const data::Derivation& kept) const {
    const auto& [name, how, middles, all] = shown;
    if (part) return {name, part_of_field(dataset, shown, *part).value()};
    if (section == nullptr) {
      // What a region keeps is not what is stored.
      auto stored = kept.variant.empty() ? dataset.stored_reduction(name, how) : std::nullopt;
      data::Derivation level = stored ? std::move(*stored) : dataset.reduction(name, how);
      level.bytes = level_bytes(completed.lattice(), components_of(name), how);
      return {name, computed_from(kept, std::move(level))};
    }
    const auto components = static_cast<int>(components_of(name));
    return {name, computed_from(kept, sampled(*section, components))};
  }
};

// A layer, still without fields, and the fields that it needs.
struct NeededLines {
  VectorLayer layer;
  Needed vectors;
  std::optional<Needed> colors;
};
struct NeededMedium {
  ScalarLayer layer;
  Needed values;
};
struct NeededScene {
  std::optional<Section> section;
  std::optional<NeededLines> lines;
  std::vector<NeededMedium> media;
};

// The lines of a plane, whose vectors and colours do not depend on the axes of the grid.
void set_plane(const Section& plane, const std::string& field, const data::Derivation& kept,
               const ComponentFactors& factors, NeededLines& lines) {
  VectorLayer& layer = lines.layer;
  const bool by_axes = layer.color_by == LineColor::world_z || layer.color_by == LineColor::rise ||
                       layer.color_by == LineColor::direction;
  if (by_axes) {
    lines.colors = Needed{field, computed_from(kept, sampled_colors(plane, factors, layer))};
    if (layer.color_by == LineColor::rise) layer.color.range = {0, 1};
    layer.color_by = LineColor::scalar;
  }
  lines.vectors = {field, computed_from(kept, sampled_vectors(plane, factors))};
}

void set_factors(const ComponentFactors& factors, const Fields& fields, VectorLayer& layer) {
  layer.scale = factors.scale;
  const auto& rates = factors.rates;
  if (!rates) return;
  layer.rate_x = rates->x;
  layer.rate_y = rates->y;
  layer.rate_z = rates->z;
  if (fields.section == nullptr) return;
  layer.rate_x = along_section(*fields.section, 1, std::move(layer.rate_x));
  layer.rate_z = along_section(*fields.section, 2, std::move(layer.rate_z));
}

Result<NeededLines> needed_lines(const View& view, const Placed& placed, const Fields& fields) {
  const protocol::VectorView& from = view.vector;
  NeededLines lines;
  VectorLayer& layer = lines.layer;
  const auto factors =
      component_factors(view, placed, *fields.dataset.info().find(from.field.name));
  if (!factors) return factors.error();
  layer.length = from.length.value();
  layer.span = from.span;
  layer.stride = from.stride.value();
  set_radii(from, view.image.height, layer);
  layer.mark = mark_of(from, view.image.height);
  set_colors(from, layer);
  layer.jitter_center = from.jitter.center;
  layer.jitter_stride = from.jitter.stride;
  layer.overlap = from.jitter.overlap;
  layer.seed = static_cast<std::uint32_t>(from.jitter.seed);
  layer.moving = from.motion == protocol::MotionMode::phase;
  if (layer.moving) layer.motion_cycles = from.motion_rate * (view.step + from.motion_time);
  layer.epoch = from.jitter.per_step ? static_cast<std::uint32_t>(view.step) : 0U;
  if (has_seeds(view)) layer.min_magnitude = 0;  // chosen lines have no gaps
  layer.combine_or = from.combine == protocol::LineCombination::either &&
                     (view.geometry.slice || view.geometry.plane);
  if (layer.color_by == LineColor::scalar) {
    lines.colors = fields.of_lines({*from.color.field, drawn(fields.coarsening, view)});
  }
  if (view.geometry.plane) {
    const auto kept = fields.kept_of(from.field.name, protocol::FilterOf::lines);
    set_plane(*fields.section, from.field.name, kept, *factors, lines);
  } else {
    set_factors(*factors, fields, layer);
    const ShownField shown =
        lines_at(view, fields.coarsening, fields.completed.lattice(), fields.dataset);
    if (shown.middles) layer.field_stride = layer.stride;
    layer.holds_all = shown.all;
    lines.vectors = fields.of_lines(shown);
  }
  return lines;
}

Shading shading_of(protocol::MediumShading shading) {
  if (shading == protocol::MediumShading::scatter) return Shading::scatter;
  return shading == protocol::MediumShading::gradient ? Shading::gradient : Shading::none;
}

NeededMedium needed_medium(const protocol::ScalarView& from, const Fields& fields) {
  ScalarLayer layer;
  layer.color = make_table(from.color.map.value(), from.color.range.value());
  layer.extinction = from.extinction.value();
  layer.min_optical_depth = from.min_optical_depth;
  layer.stride = from.stride;
  layer.shading = shading_of(from.shading);
  return {std::move(layer), fields.of_medium(from.field)};
}

Result<NeededScene> needed_scene(const CompletedView& completed, const DrawnPart& part,
                                 const data::Dataset& dataset) {
  const View& view = completed.view();
  const std::shared_ptr<const Placed>& placed = completed.placed();
  NeededScene needed;
  if (is_section(view.geometry)) {
    auto section = make_section(view.geometry, placed->lattice);
    if (!section) return section.error();
    section->owner = placed;
    needed.section = std::move(*section);
  }
  const Fields fields{dataset, completed, coarsening_of(placed->lattice, part.halvings), part.held,
                      needed.section ? &*needed.section : nullptr};
  if (shows_lines(view)) {
    auto lines = needed_lines(view, *placed, fields);
    if (!lines) return lines.error();
    needed.lines = std::move(*lines);
  }
  for (const protocol::ScalarView& scalar : *view.scalars) {
    if (absorbs(scalar)) needed.media.push_back(needed_medium(scalar, fields));
  }
  return needed;
}

Result<void> load(const Needed& needed, std::size_t step, data::Dataset& dataset,
                  std::shared_ptr<const data::Volume>& to) {
  auto volume = dataset.derived(needed.field, step, needed.how);
  if (!volume) return volume.error();
  to = std::move(*volume);
  return {};
}

// Adds lattice and layers. The places of a section come last: the volumes from which its fields are
// computed need not fit into memory beside them.
Result<Scene> with_data(Scene scene, NeededScene needed, const CompletedView& completed,
                        data::Dataset& dataset) {
  const Lattice& whole = completed.lattice();
  const auto step = static_cast<std::size_t>(completed.view().step);
  if (needed.lines) {
    auto& [layer, vectors, colors] = *needed.lines;
    if (colors) {
      if (auto ok = load(*colors, step, dataset, layer.color_field); !ok) return ok.error();
    }
    if (auto ok = load(vectors, step, dataset, layer.field); !ok) return ok.error();
    merge_lines(whole, scene.level, pixels_per_unit(scene.camera, whole), layer);
    if (has_streamlets(completed.view())) {
      auto segments = traced_of(completed.view(), *completed.placed(), layer, vectors.how, dataset);
      if (!segments) return segments.error();
      layer.streamlets = std::move(*segments);
    }
    scene.vector = std::move(layer);
  }
  std::vector<std::string> media;  // identify the volumes
  for (auto& [layer, values] : needed.media) {
    if (auto ok = load(values, step, dataset, layer.field); !ok) return ok.error();
    scene.scalars.push_back(std::move(layer));
    media.push_back(values.field + '\n' + std::to_string(step) + '\n' + values.how.variant);
  }
  if (!needed.section) {
    const auto part = scene.lattice.part;
    scene.lattice = coarsen_lattice(whole, scene.level);
    scene.lattice.part = part;
    if (auto lit = light::light_scene(completed.view(), media, dataset, scene); !lit) {
      return lit.error();
    }
    return scene;
  }
  auto lattice = lattice_of(*needed.section, dataset);
  if (!lattice) return lattice.error();
  scene.lattice = std::move(*lattice);
  scene.slice = Slice{needed.section->axis, 0};
  scene.sampling_us = *needed.section->sampling_us;
  return scene;
}

}  // namespace

Result<Scene> build_scene(const CompletedView& completed, data::Dataset& dataset,
                          StandIn stand_in) {
  const View& view = completed.view();
  const Lattice& lattice = completed.lattice();
  Scene scene;
  scene.slice = slice_of(view.geometry, lattice);
  scene.camera = completed.camera();
  const auto depths = view_depths(scene.camera, lattice);
  const double depth = depths[1] - depths[0];
  // It applies to lines only.
  const double cue = view.vector.color.true_colors ? 0 : view.depth_cue.strength;
  scene.depth_cue = {cue, depths[0] + view.depth_cue.near * depth,
                     depths[0] + view.depth_cue.far * depth};
  scene.method = engine_method(view.method.name);
  scene.compositing = engine_compositing(view.method.compositing);
  scene.slab_thickness = view.method.slab_thickness;
  scene.stop_transmittance = view.method.stop_transmittance;
  scene.background = parse_color(view.image.background).value();
  DrawnPart part = part_of(completed, dataset);
  if (stand_in == StandIn::allowed) {
    auto other = stand_in_for(completed, part, dataset);
    if (!other) other = base_for(completed, part, dataset);
    if (other) {
      part = other->part;
      scene.missing_bytes = other->missing_bytes;
    }
  }
  scene.level = part.halvings;
  scene.lattice.part = part.held;
  if (dataset.info().stored != nullptr) scene.wanted_level = part.wanted;
  auto needed = needed_scene(completed, part, dataset);
  if (!needed) return needed.error();
  auto body = make_body(view, scene.camera, *completed.placed(), dataset);
  if (!body) return body.error();
  scene.body = std::move(*body);
  auto surfaces = make_surfaces(completed, dataset);
  if (!surfaces) return surfaces.error();
  scene.surfaces = std::move(*surfaces);
  return with_data(std::move(scene), std::move(*needed), completed, dataset);
}

double detail_shown(const CompletedView& completed) {
  const View& view = completed.view();
  if (is_drawn_in_full(view) || merge_limits(view).samples < 2) return 0;
  const auto slice = slice_of(view.geometry, completed.lattice());
  return finest_cell_px(completed.camera(), completed.lattice(), slice) / halved_below_px;
}

Result<Needs> needs_of(const CompletedView& completed, const data::Dataset& dataset) {
  auto needed = needed_scene(completed, part_of(completed, dataset), dataset);
  if (!needed) return needed.error();
  Needs needs;
  if (needed->lines) {
    needs.fields.push_back(std::move(needed->lines->vectors));
    if (needed->lines->colors) needs.fields.push_back(std::move(*needed->lines->colors));
  }
  for (auto& [layer, values] : needed->media) needs.fields.push_back(std::move(values));
  for (auto& [field, how] : needed_by_surfaces(completed)) {
    needs.fields.push_back({std::move(field), std::move(how)});
  }
  if (needed->section) needs.places = places_of(*needed->section);
  return needs;
}

Result<Scene> build_scene(const View& view, data::Dataset& dataset) {
  const auto completed = complete(view, dataset);
  return completed ? build_scene(*completed, dataset) : completed.error();
}

}  // namespace windsplat::scene
