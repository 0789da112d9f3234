// What a completed view shows, as far as that follows from the view alone.
#pragma once

#include <algorithm>
#include <cmath>

#include "protocol/view.hpp"

namespace windsplat::protocol {

inline bool shows_lines(const View& view) {
  return view.vector.field.kind == FieldChoice::Kind::named && view.vector.opacity > 0;
}

inline bool has_strided_lines(const View& view) {
  return shows_lines(view) && view.vector.stride.value_or(1) > 1;
}

// Whether lines follow the flow.
inline bool has_streamlets(const View& view) { return view.vector.trace.has_value(); }

// Whether they are those through seeds.
inline bool has_seeds(const View& view) { return view.vector.trace && view.vector.trace->seeds; }

// Extinctions that follow from the data are not yet known for an outline.
inline bool absorbs(const ScalarView& scalar) {
  return !scalar.extinction || std::any_of(scalar.extinction->begin(), scalar.extinction->end(),
                                           [](const auto& point) { return point[1] > 0; });
}

// Whether a plane is interpolated between samples.
inline bool is_section(const GeometryView& geometry) {
  return geometry.plane ||
         (geometry.slice && geometry.slice->index != std::floor(geometry.slice->index));
}

// Whether samples are never merged. The splats of a stride are those of its samples. Lines with a
// stride without a medium leave out more samples than a level would. The reference merges no
// samples, a section has its own, and streamlets follow the field itself.
inline bool is_drawn_in_full(const View& view) {
  const auto any = [&](const auto& holds) {
    return view.scalars && std::any_of(view.scalars->begin(), view.scalars->end(), holds);
  };
  const bool strided = any([](const ScalarView& of) { return of.stride > 1; }) ||
                       (has_strided_lines(view) && !any(absorbs));
  const bool traced = shows_lines(view) && has_streamlets(view);
  return view.method.detail == Detail::full || strided || traced || is_section(view.geometry) ||
         view.method.name == MethodName::reference;
}

}  // namespace windsplat::protocol
