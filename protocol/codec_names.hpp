// The names of the enumerators of a view in JSON.
#pragma once

#include <array>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

inline constexpr std::array<Name<Projection>, 2> projection_names{
    {{Projection::perspective, "perspective"}, {Projection::orthographic, "orthographic"}}};
inline constexpr std::array<Name<VerticalPlacement>, 5> vertical_names{
    {{VerticalPlacement::automatic, "auto"},
     {VerticalPlacement::linear, "linear"},
     {VerticalPlacement::logp, "logp"},
     {VerticalPlacement::index, "index"},
     {VerticalPlacement::metric, "metric"}}};
inline constexpr std::array<Name<GeometryMapping>, 3> mapping_names{
    {{GeometryMapping::flat, "flat"},
     {GeometryMapping::curvilinear, "curvilinear"},
     {GeometryMapping::sphere, "sphere"}}};
inline constexpr std::array<Name<GroundShow>, 3> ground_show_names{
    {{GroundShow::automatic, "auto"}, {GroundShow::on, "on"}, {GroundShow::off, "off"}}};
inline constexpr std::array<Name<GridAxis>, 3> axis_names{
    {{GridAxis::x, "x"}, {GridAxis::y, "y"}, {GridAxis::z, "z"}}};
inline constexpr std::array<Name<VectorSpace>, 2> space_names{
    {{VectorSpace::components, "components"}, {VectorSpace::world, "world"}}};
inline constexpr std::array<Name<ColorBy>, 7> color_by_names{{{ColorBy::world_z, "worldZ"},
                                                              {ColorBy::screen_z, "screenZ"},
                                                              {ColorBy::rise, "rise"},
                                                              {ColorBy::magnitude, "magnitude"},
                                                              {ColorBy::direction, "direction"},
                                                              {ColorBy::scalar, "scalar"},
                                                              {ColorBy::constant, "constant"}}};
inline constexpr std::array<Name<LineCombination>, 2> combination_names{
    {{LineCombination::over, "over"}, {LineCombination::either, "or"}}};
inline constexpr std::array<Name<MarkShape>, 4> mark_shape_names{{{MarkShape::line, "line"},
                                                                  {MarkShape::taper, "taper"},
                                                                  {MarkShape::arrow, "arrow"},
                                                                  {MarkShape::comet, "comet"}}};
inline constexpr std::array<Name<MotionMode>, 2> motion_names{
    {{MotionMode::still, "still"}, {MotionMode::phase, "phase"}}};
inline constexpr std::array<Name<MethodName>, 3> method_names{
    {{MethodName::kernel, "kernel"},
     {MethodName::slab, "slab"},
     {MethodName::reference, "reference"}}};
inline constexpr std::array<Name<Compositing>, 5> compositing_names{
    {{Compositing::simple, "simple"},
     {Compositing::cd_naive, "cd-naive"},
     {Compositing::cd, "cd"},
     {Compositing::analytic, "analytic"},
     {Compositing::cd_euler, "cd-euler"}}};
inline constexpr std::array<Name<Detail>, 2> detail_names{
    {{Detail::automatic, "auto"}, {Detail::full, "full"}}};
inline constexpr std::array<Name<MediumShading>, 3> shading_names{
    {{MediumShading::scatter, "scatter"},
     {MediumShading::gradient, "gradient"},
     {MediumShading::none, "none"}}};

}  // namespace windsplat::protocol
