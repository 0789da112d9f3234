// The settings among which a frame's is chosen, and a view drawn at one of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/view.hpp"

namespace windsplat::quality {

// How a frame is drawn where the server may choose. Widths and heights are the view's times
// 2^(-half_level / 2); of the data an axis is halved `coarser` times more than the picture asks
// for; slabs are as thick as the view's over `thinner`.
struct Setting {
  protocol::MethodName method = protocol::MethodName::kernel;
  int half_level = 0;
  int coarser = 0;
  int thinner = 1;
  bool operator==(const Setting&) const = default;
};

// Strides and other stops are not among them: at equal time their error is larger
// (docs/benchmarks/error.md).
inline constexpr std::array<Setting, 26> settings{{
    {protocol::MethodName::kernel, 0, 0},  {protocol::MethodName::kernel, 1, 0},
    {protocol::MethodName::kernel, 2, 0},  {protocol::MethodName::kernel, 3, 0},
    {protocol::MethodName::kernel, 4, 0},  {protocol::MethodName::kernel, 5, 0},
    {protocol::MethodName::kernel, 6, 0},  {protocol::MethodName::kernel, 8, 0},
    {protocol::MethodName::kernel, 0, 1},  {protocol::MethodName::kernel, 1, 1},
    {protocol::MethodName::kernel, 2, 1},  {protocol::MethodName::kernel, 3, 1},
    {protocol::MethodName::kernel, 4, 1},  {protocol::MethodName::kernel, 6, 1},
    {protocol::MethodName::kernel, 1, 2},  {protocol::MethodName::kernel, 2, 2},
    {protocol::MethodName::kernel, 4, 2},  {protocol::MethodName::kernel, 6, 2},
    {protocol::MethodName::slab, 0, 0},    {protocol::MethodName::slab, 1, 0},
    {protocol::MethodName::slab, 2, 0},    {protocol::MethodName::slab, 4, 0},
    {protocol::MethodName::slab, 0, 1},    {protocol::MethodName::slab, 2, 1},
    {protocol::MethodName::slab, 0, 0, 2}, {protocol::MethodName::slab, 0, 0, 4},
}};
inline constexpr std::size_t settings_count = settings.size();

// An edge of the picture at a half level, at least one pixel.
int edge_at(int edge, int half_level);
// The finest level of whole halvings that is not finer than a half level: the wire's.
inline std::uint8_t wire_level(int half_level) { return static_cast<std::uint8_t>(half_level / 2); }

// The view by the setting's method and slabs, unless it asks for the reference. Its picture's size
// stays: that is the encoding's.
protocol::View at_setting(protocol::View view, const Setting& setting);

// The setting that draws the view as it stands: one of `settings`, method reference apart.
std::size_t own_setting(const protocol::View& view);
std::optional<std::size_t> index_of(const Setting& setting);

// Whether the server may draw the view so: a view that names method kernel is not drawn by slabs
// unless it asks for an error; slabs thinner than the wire's limit are left out, and pictures with
// an edge of less than 64 pixels unless it is the view's own.
bool is_allowed(const Setting& setting, const protocol::View& view);

}  // namespace windsplat::quality
