// All limits of the protocol. The schemas repeat those of the view; a test compares them.
#pragma once

#include <cstddef>
#include <cstdint>

namespace windsplat::protocol::limits {

inline constexpr std::size_t message_bytes_max = std::size_t{64} * 1024;  // one JSON document
inline constexpr std::size_t json_depth_max = 32;
inline constexpr std::size_t http_header_bytes_max = std::size_t{8} * 1024;
inline constexpr std::size_t http_body_bytes_max = message_bytes_max;
inline constexpr int http_header_timeout_s = 5;
inline constexpr int http_body_timeout_s = 5;
inline constexpr int write_timeout_s = 15;

inline constexpr int image_edge_max = 8192;  // pixels
inline constexpr std::int64_t image_pixels_max = 8192LL * 4320LL;
inline constexpr int extinction_points_max = 64;
inline constexpr int scalars_max = 4;
inline constexpr int surfaces_max = 8;
inline constexpr int contour_levels_max = 64;
inline constexpr double extinction_max = 1e30;  // per world unit
inline constexpr double radius_max = 64;        // r1, r2, pixels at a height of 720
inline constexpr double mark_head_min = 1;      // width and length of the head of an arrow, pixels
inline constexpr double mark_head_max = 64;
inline constexpr double halo_max = 16;    // pixels at a height of 720
inline constexpr double fov_min = 0.001;  // degrees
inline constexpr double fov_max = 179;
inline constexpr int stride_max = 64;
inline constexpr double span_max = 64;
inline constexpr double world_max = 1e6;         // camera positions
inline constexpr double view_height_min = 1e-6;  // world units, orthographic
inline constexpr double up_length_min = 1e-6;
inline constexpr double geometry_scale_min = 1e-3;
inline constexpr double geometry_scale_max = 1e3;
inline constexpr double component_scale_max = 1e9;
inline constexpr double line_length_max = 10;   // world units
inline constexpr double span_min = 0.1;         // grid strides
inline constexpr int segments_max = 64;         // of a streamlet
inline constexpr double step_error_min = 1e-9;  // grid cells
inline constexpr double step_error_max = 0.1;
inline constexpr int seeds_max = 5000;          // of lines, of all kinds together
inline constexpr int pieces_max = 4096;         // of a line through a seed
inline constexpr int path_steps_max = 24;       // before and after the step of the view
inline constexpr double seed_length_max = 100;  // world units to each side
inline constexpr double dash_min = 1e-3;        // world units
inline constexpr double dash_max = 10;
inline constexpr double value_max = 1e38;  // largest value of a field
inline constexpr double range_width_min = 1e-30;
inline constexpr double motion_rate_max = 1e3;
inline constexpr double motion_time_max = 1e6;      // steps
inline constexpr double slab_thickness_min = 0.05;  // grid cells along the line of sight
inline constexpr double slab_thickness_max = 64;
inline constexpr std::int64_t slice_index_max = 2147483647;
inline constexpr double optical_depth_max = 1e3;
inline constexpr double annotation_size_min = 0.25;
inline constexpr double annotation_size_max = 4;
inline constexpr std::size_t filters_max = 4;            // of a region
inline constexpr std::size_t polygon_points_max = 2000;  // of all rings of a region
inline constexpr double depth_cue_max = 10;              // depths of the volume
inline constexpr double budget_ms_min = 1;
inline constexpr double budget_ms_max = 10000;
inline constexpr double max_error_min = 5e-6;  // linear RMSE; that of single precision
inline constexpr double max_error_max = 1;
inline constexpr std::int64_t step_max = 2147483647;
inline constexpr std::int64_t seed_max = 4294967295;
inline constexpr std::size_t name_chars_max = 256;  // maximum length of the name of a dataset,
                                                    // field or map, in code points

inline constexpr std::int64_t serial_max = 4294967295;  // id, rev and seq of messages
inline constexpr double fps_min = 0.1;
inline constexpr double fps_max = 120;
inline constexpr double still_scale_max = 4;
inline constexpr double decode_ms_max = 1e9;
inline constexpr std::size_t problem_errors_max = 16;  // invalid values listed in one response

inline constexpr std::size_t path_chars_max = 4096;  // code points of a path below the data root
inline constexpr std::size_t selection_entries_max = 16;  // entries chosen by one request
inline constexpr int histogram_bins_max = 4096;
inline constexpr double histogram_clip_max = 0.49;  // maximum fraction of the values at either end
inline constexpr double coordinate_max = 1e30;      // largest coordinate of a probe, in the units
                                                    // of the axes
inline constexpr int series_steps_max = 100000;
inline constexpr int jobs_max = 64;  // including finished ones
inline constexpr int jobs_running_max = 2;
inline constexpr std::size_t values_bytes_max = 67108864;   // of one array of values
inline constexpr std::size_t values_columns_max = 1000000;  // with positions of their own
inline constexpr int views_max = 10000;                     // stored by a server
inline constexpr int views_bytes_max = 16777216;            // total of all views as JSON

inline constexpr std::size_t video_codecs_max = 16;  // names in one announcement
inline constexpr int frames_in_flight_max = 2;       // unacknowledged, per session
inline constexpr int sessions_max_default = 64;

}  // namespace windsplat::protocol::limits
