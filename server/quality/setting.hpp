// The settings that the server may choose for a frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "protocol/view.hpp"

namespace windsplat::quality {

// Width and height are about those of the view times 2^(-half_level / 2 - sixteenths / 16)
// (size_at); axes of the data are halved `coarser` times more than the picture requires; slabs have
// the thickness of the view divided by `thinner`.
struct Setting {
  protocol::MethodName method = protocol::MethodName::kernel;
  int half_level = 0;
  int coarser = 0;
  int thinner = 1;
  int sixteenths = 0;  // 0 to 7; 0 in every setting of the list below
  bool operator==(const Setting&) const = default;
};
inline constexpr int sixteenths_per_half_level = 8;

// The settings that calibration runs measure; those of sizes between them: quality/sizes.
// Strides and other thresholds of early ray termination are not included: at the same run time
// their error is larger (docs/benchmarks/error.md).
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

struct PictureSize {
  int width = 1;
  int height = 1;
  bool operator==(const PictureSize&) const = default;
};

// The picture of a view of this size at the setting, at least one pixel. Of the sizes within a few
// rows it is the one whose proportions are nearest to those of the view, since other proportions
// move what is shown.
PictureSize size_at(const PictureSize& view, const Setting& setting);
PictureSize size_at(const protocol::View& view, const Setting& setting);
// The level in whole halvings, as transmitted in frame headers; rounded down.
inline std::uint8_t wire_level(int half_level) { return static_cast<std::uint8_t>(half_level / 2); }

// The view with the method and slab thickness of the setting, unless its method is reference. The
// picture size is left to the encoder.
protocol::View at_setting(protocol::View view, const Setting& setting);

// Index of the setting that renders the view unchanged; for method reference the index of the same
// view with method kernel.
std::size_t own_setting(const protocol::View& view);
std::optional<std::size_t> index_of(const Setting& setting);

// Whether the server may use the setting for the view. A view of method kernel is drawn with slabs
// only if it limits the error; slabs below the protocol's least thickness are excluded, as are
// reduced pictures with an edge below 64 pixels, and coarser data if those of the view are never
// merged.
bool is_allowed(const Setting& setting, const protocol::View& view);
// The same, if the size of its picture is known.
bool is_allowed(const Setting& setting, const protocol::View& view, const PictureSize& size);

// Whether the setting is more accurate than the one that renders the view unchanged: thinner slabs,
// and all slabs for a view of method kernel.
bool is_finer(const Setting& setting, const protocol::View& view);

}  // namespace windsplat::quality
