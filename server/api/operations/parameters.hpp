// The query parameters of all routes.
#pragma once

#include "protocol/limits.hpp"
#include "server/api/operations/operation.hpp"
#include "server/frame/frame.hpp"
#include "server/uploads/uploads.hpp"

namespace windsplat::api::parameters {

namespace limits = protocol::limits;
using Kind = ParameterKind;

// --- pictures -----------------------------------------------------------------------------------

inline constexpr Parameter width{"width", Kind::integer,          "Pixels.",
                                 1,       limits::image_edge_max, "1280"};
inline constexpr Parameter height{"height", Kind::integer,          "Pixels.",
                                  1,        limits::image_edge_max, "720"};
inline constexpr Parameter azimuth{
    "azimuth", Kind::number,
    "Direction of the view, degrees: 0 looks north, 90 west, from the east.", -36000, 36000};
inline constexpr Parameter elevation{"elevation", Kind::number,
                                     "Height of the eye, degrees above the horizon.", -90, 90};
inline constexpr Parameter zoom{
    "zoom", Kind::number, "Enlargement of what the default camera shows.", 1e-3, 1e3, "1"};
inline constexpr Parameter preset{"preset", Kind::text,
                                  "Name of a look, as listed by /v1/presets."};
inline constexpr Parameter quality{"quality", Kind::integer, "Quality of the JPEG.", 1, 100, "90"};
inline constexpr Parameter dpi{"dpi", Kind::number,
                               "Pixels to the inch: sets the size of PDF and SVG on paper, and is "
                               "written into PNG; JPEG and NPY have none and refuse it.",
                               frame::dots_per_inch_min, frame::dots_per_inch_max};
inline constexpr Parameter time{"datetime", Kind::text,
                                "Time of a step (RFC 3339), instead of its number."};
inline constexpr Parameter nearest{
    "nearest", Kind::boolean, "Whether the step nearest to datetime may have another time.", 0,
    0,         "false"};
inline constexpr Parameter drawn_fields{
    "field", Kind::names, "The fields that are drawn, and no others: at most one vector."};
inline constexpr Parameter color_map{"colormap", Kind::text,
                                     "Name of a colour map, as listed by /v1/colormaps."};
inline constexpr Parameter annotate{
    "annotate", Kind::names, "true, false, or the annotations that are drawn, and no others."};
inline constexpr Parameter pixel_x{
    "x", Kind::number, "Pixels from the left edge of the picture.", 0, limits::image_edge_max, "",
    {},  true};
inline constexpr Parameter pixel_y{
    "y", Kind::number, "Pixels from the upper edge of the picture.", 0, limits::image_edge_max, "",
    {},  true};

// --- values -------------------------------------------------------------------------------------

inline constexpr Parameter step{"step", Kind::integer,    "Time step, counted from 0.",
                                0,      limits::step_max, "0"};
inline constexpr Parameter x{
    "x", Kind::number,
    "Longitude, degrees, where every column has one; otherwise a coordinate of the x axis.",
    -limits::coordinate_max, limits::coordinate_max};
inline constexpr Parameter y{
    "y", Kind::number,
    "Latitude, degrees, where every column has one; otherwise a coordinate of the y axis.",
    -limits::coordinate_max, limits::coordinate_max};
inline constexpr Parameter z{
    "z", Kind::number,
    "Coordinate of the vertical axis; with heightField a height in the unit of that field.",
    -limits::coordinate_max, limits::coordinate_max};
inline constexpr Parameter longitude{
    "lon", Kind::number, "Degrees; refused where columns have no longitudes.", -360, 360};
inline constexpr Parameter latitude{"lat", Kind::number,
                                    "Degrees; refused where columns have no latitudes.", -90, 90};
inline constexpr Parameter level{"level", Kind::number, "Coordinate of the vertical axis, as z.",
                                 -limits::coordinate_max, limits::coordinate_max};
inline constexpr Parameter index{
    "index", Kind::indices,
    "Sample i,j,k, counted from 0 at the west, south and bottom, instead of x, y and z."};
inline constexpr Parameter height_field{"heightField", Kind::text,
                                        "A field of heights, by which z is a height in a column."};
inline constexpr Parameter fields{"fields", Kind::names, "Derived fields that are computed, too."};
inline constexpr Parameter minus{"minus", Kind::text,
                                 "Id of a dataset whose values are subtracted."};
inline constexpr Parameter minus_step{"minusStep", Kind::integer,
                                      "Time step that is subtracted, counted from 0.", 0,
                                      limits::step_max};
inline constexpr Parameter box{
    "bbox", Kind::text,
    "Four numbers west,south,east,north, ends included: degrees, of data without longitudes "
    "coordinates of the axes x and y."};
inline constexpr Parameter levels{
    "level", Kind::text,
    "A level of the vertical axis, or the ends of a range of levels as two numbers."};
inline constexpr Parameter stride{"stride", Kind::text,
                                  "Every so many samples: integers x,y,z, or one for x and y."};
inline constexpr Parameter bins{
    "bins", Kind::integer, "Number of bins.", 1, limits::histogram_bins_max, "64"};
inline constexpr Parameter range{"range", Kind::pair,
                                 "Range of the bins, ascending; without it that of the values.",
                                 -limits::value_max, limits::value_max};
inline constexpr Parameter clip{
    "clip",
    Kind::number,
    "Part of the values that the range leaves out at each end; not together with range.",
    0,
    limits::histogram_clip_max,
    "0"};
inline constexpr Parameter log{"log", Kind::boolean, "Whether bins have equal ratios.", 0,
                               0,     "false"};
inline constexpr Parameter range_of{
    "of", Kind::choice, "Steps that the range covers.", 0, 0, "\"step\"", {"step", "all"}};

// --- files --------------------------------------------------------------------------------------

inline constexpr Parameter folder{
    "folder", Kind::text, "Folder below the data root; without it the data root.", 0, 0, "\"\""};
inline constexpr Parameter after{"after", Kind::text,
                                 "Continue behind this name, the `next` of the page before."};
inline constexpr Parameter limit{"limit", Kind::integer, "Names on a page.", 1, 500, "200"};
inline constexpr Parameter forget{
    "forget",
    Kind::boolean,
    "Remove the dataset from the list, if it was opened by POST or could not be opened.",
    0,
    0,
    "false"};

// --- uploads ------------------------------------------------------------------------------------

inline constexpr Parameter keep{
    "keep", Kind::integer,       "Seconds after which the upload is removed.",
    1,      uploads::keep_s_max, "3600"};

}  // namespace windsplat::api::parameters
