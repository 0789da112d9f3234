// The view: everything that determines a picture except its encoding, as typed values. Mirrors
// view.schema.json with the same defaults (a test compares them). An empty optional means the
// default of the dataset, which scene/complete resolves.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace windsplat::protocol {

using Vec3 = std::array<double, 3>;
using Range = std::array<double, 2>;

enum class Projection { perspective, orthographic };
enum class VerticalPlacement { automatic, linear, logp, index, metric };
enum class GeometryMapping { flat, curvilinear, sphere };
enum class GroundShow { automatic, on, off };
enum class GridAxis { x, y, z };
enum class VectorSpace { components, world };
enum class ColorBy { world_z, screen_z, rise, magnitude, direction, scalar, constant };
enum class LineCombination { over, either };  // either: "or"
enum class MarkShape { line, taper, arrow, comet };
enum class MotionMode { still, phase };
enum class MethodName { kernel, slab, reference };
enum class Compositing { simple, cd_naive, cd, analytic, cd_euler };
enum class Detail { automatic, full };
enum class MediumShading { scatter, gradient, none };

struct CameraView {
  std::optional<Projection> projection;  // default: orthographic where the eye faces a slice
  std::optional<Vec3> eye;               // world
  std::optional<Vec3> target;            // world
  Vec3 up{0, 0, 1};
  double fov_y = 35;             // degrees, perspective
  std::optional<double> height;  // world height of the picture at the target, orthographic
  bool operator==(const CameraView&) const = default;
};

struct ImageView {
  int width = 1280;
  int height = 720;
  std::string background = "#000000";  // sRGB
  bool operator==(const ImageView&) const = default;
};

// One layer of the grid, or between two of its layers.
struct SliceView {
  GridAxis axis = GridAxis::z;
  double index = 0;  // grid samples
  bool operator==(const SliceView&) const = default;
};

// A plane through the grid.
struct PlaneView {
  Vec3 point{0, 0, 0};   // world
  Vec3 normal{0, 0, 1};  // of any length
  bool operator==(const PlaneView&) const = default;
};

struct GeometryView {
  Vec3 scale{1, 1, 1};
  VerticalPlacement vertical = VerticalPlacement::automatic;
  GeometryMapping mapping = GeometryMapping::flat;
  std::optional<std::string> height_field;  // empty: use the vertical coordinate
  std::optional<SliceView> slice;           // empty: the whole grid
  std::optional<PlaneView> plane;           // empty: the whole grid, or the slice
  bool operator==(const GeometryView&) const = default;
};

// A field by name, the default of the dataset (key absent), or none (null).
struct FieldChoice {
  enum class Kind { dataset_default, none, named };
  Kind kind = Kind::dataset_default;
  std::string name;  // only when named
  bool operator==(const FieldChoice&) const = default;
};

struct VectorColorView {
  std::optional<ColorBy> by;
  std::string map = "viridis";
  std::optional<std::string> field;  // `scalar` only
  std::optional<Range> range;        // values of the quantity `by` at the ends of the map
  double rise_weight = 0.5;          // 0..1, `rise` only: 0 height only, 1 rise only
  std::string constant = "#ffffff";  // sRGB, `constant` only
  // Lines have the hues of the map: no whitening of heads, dimming by magnitude or depth cue.
  bool true_colors = false;
  bool operator==(const VectorColorView&) const = default;
};

// Seeds at equal distances, in the coordinates of the axes.
struct SeedLineView {
  Vec3 from{};
  Vec3 to{};
  int count = 20;
  bool operator==(const SeedLineView&) const = default;
};
struct SeedBlockView {
  Vec3 from{};
  Vec3 to{};
  std::array<int, 3> counts{8, 8, 1};  // along each axis
  bool operator==(const SeedBlockView&) const = default;
};

// Where lines begin, and how far each is followed.
struct SeedsView {
  std::optional<int> evenly;  // empty: 100, or 0 with other seeds
  std::vector<Vec3> points;
  std::optional<SeedLineView> line;
  std::optional<SeedBlockView> block;
  std::optional<double> length;    // world units to each side; empty: the diagonal of the box
  std::optional<double> duration;  // to each side; empty: any
  int path_steps = 0;              // of paths through time, before and after; 0: streamlines
  int pieces = 500;                // of a line, at most
  double dash = 0.15;              // world units at the top of magnitude_range
  bool operator==(const SeedsView&) const = default;
};

// Curved lines that follow the flow in place of straight ones.
struct TraceView {
  int segments = 8;                // straight pieces of a line, at most
  double step_error = 1e-3;        // of each step of the integration, grid cells
  std::optional<SeedsView> seeds;  // empty: a line for each sample
  bool operator==(const TraceView&) const = default;
};

struct JitterView {
  double center = 0.5;  // displacement range of the line in its kernel, strides
  double stride = 0.3;  // displacement range of the kernel, strides
  bool overlap = true;  // kernels are `span` strides wide; false: one stride
  std::int64_t seed = 1;
  bool per_step = false;  // a new pattern for each time step
  bool operator==(const JitterView&) const = default;
};

// How lines show their direction and their order in depth. Lengths in pixels at a picture height of
// 720.
struct MarkView {
  MarkShape shape = MarkShape::line;
  double head_width = 7;                 // arrow: across its base
  double head_length = 10;               // arrow
  std::optional<double> tail_darkening;  // 0..1; its default follows shape and colours
  double halo = 0;                       // width of the dark rim; 0: none
  bool operator==(const MarkView&) const = default;
};

struct VectorView {
  FieldChoice field;
  VectorSpace space = VectorSpace::components;
  Vec3 scale{1, 1, 1};
  std::optional<double> length;  // world units drawn at the top of magnitude_range
  double span = 7;               // kernel width in grid strides
  std::optional<int> stride;     // grid samples
  double r1 = 0.6;               // pixels at a picture height of 720
  double r2 = 1.4;
  double opacity = 0.8;
  LineCombination combine = LineCombination::over;  // of a slice or plane
  std::optional<double> head_desaturation;  // 0..1; its default follows colours and background
  MarkView mark;
  VectorColorView color;
  std::optional<Range> magnitude_range;
  std::optional<double> min_magnitude;
  double magnitude_intensity =
      0.6;  // 0: every line equally bright; 1: brightness follows magnitude
  MotionMode motion = MotionMode::still;
  double motion_rate = 1.0;  // cycles per step at the top of magnitude_range
  double motion_time = 0.0;  // steps, added to the step
  std::optional<TraceView> trace;
  JitterView jitter;
  bool operator==(const VectorView&) const = default;
};

struct ScalarColorView {
  std::optional<std::string> map;
  std::optional<Range> range;
  bool operator==(const ScalarColorView&) const = default;
};

struct ScalarView {
  std::string field;
  ScalarColorView color;
  // (value, extinction per world unit), ascending values, linear between, constant beyond.
  std::optional<std::vector<std::array<double, 2>>> extinction;
  double min_optical_depth = 1e-4;  // splats below it are skipped
  int stride = 1;
  MediumShading shading = MediumShading::scatter;  // in a lit view
  bool operator==(const ScalarView&) const = default;
};

struct DepthCueView {
  double strength = 0.3;
  double near = 0;  // 0: nearest point of the volume
  double far = 1;   // 1: farthest point of the volume
  bool operator==(const DepthCueView&) const = default;
};

struct MethodView {
  MethodName name = MethodName::slab;
  Compositing compositing = Compositing::analytic;
  double slab_thickness = 1;  // grid cells along the line of sight, `slab` only
  double stop_transmittance = 1.5e-4;
  Detail detail = Detail::automatic;  // automatic: coarser if cells are below a pixel
  bool operator==(const MethodView&) const = default;
};

// Limits within which the server chooses resolution, method and slab thickness.
struct QualityView {
  std::optional<double> budget_ms;  // milliseconds of rendering and encoding
  std::optional<double> max_error;  // linear RMSE
  bool lossless = false;            // final frames of a stream as PNG
  bool operator==(const QualityView&) const = default;
};

// How one of the annotations differs from the others.
struct AnnotationStyleView {
  double size = 1;                        // factor of that of all annotations
  std::optional<std::string> text_color;  // sRGB; empty: that of all annotations
  bool operator==(const AnnotationStyleView&) const = default;
};

// What is written and drawn around the data, each if it is set.
struct AnnotationsView {
  bool box = false;
  bool axes = false;
  bool north = false;
  bool scale_bar = false;
  bool legend = false;
  bool title = false;
  bool step_time = false;
  bool contour_labels = false;            // values on the contours of surfaces
  double size = 1;                        // factor of the size of texts and lines
  std::optional<std::string> text_color;  // sRGB; empty: contrasts with the background
  std::optional<std::string> title_text;  // empty: the title of the dataset
  AnnotationStyleView box_style;
  AnnotationStyleView axes_style;
  AnnotationStyleView north_style;
  AnnotationStyleView scale_bar_style;
  AnnotationStyleView legend_style;
  AnnotationStyleView title_style;
  AnnotationStyleView step_time_style;
  bool operator==(const AnnotationsView&) const = default;
};

// What a filter of a region applies to.
enum class FilterOf { lines, media, all };

// Samples where a field is beyond the range, or masked, are left out.
struct FilterView {
  std::string field;
  Range range{0, 0};  // both ends included
  FilterOf of = FilterOf::lines;
  bool operator==(const FilterView&) const = default;
};

// The samples that are drawn: those that satisfy every part. Ranges in the coordinates of the axes.
struct RegionView {
  std::optional<Range> x, y, z;
  std::optional<Range> longitudes, latitudes;  // of columns, degrees
  std::vector<FilterView> where;
  // Polygons of closed rings, the first of each the outer one: longitude and latitude, or x and y.
  std::vector<std::vector<std::vector<std::array<double, 2>>>> polygon;  // empty: no polygon
  bool operator==(const RegionView&) const = default;
};

// Time and place that determine where the sun is.
struct SunAtView {
  std::string utc = "2000-01-01T12:00:00Z";
  double longitude = 0;  // degrees
  double latitude = 0;
  bool operator==(const SunAtView&) const = default;
};

// Light of a sun that media scatter.
struct LightView {
  double azimuth = 225;             // degrees clockwise from north (+y)
  double elevation = 40;            // degrees above the horizon
  std::optional<SunAtView> sun_at;  // empty: azimuth and elevation
  double ambient = 0.2;
  double brightness = 2;  // of the sun
  double anisotropy = 0;  // of the phase function
  double shadows = 5;     // factor of the extinctions on the way of the light
  bool operator==(const LightView&) const = default;
};

// Colours of a surface: those of a map by the values of a field, or one.
struct SurfaceColorView {
  std::string map = "viridis";
  std::optional<std::string> field;  // empty: that of a section; an isosurface has one colour
  std::optional<Range> range;
  std::string constant = "#d8d8d8";  // sRGB, of an isosurface
  bool operator==(const SurfaceColorView&) const = default;
};

// Lines of constant value of the field that colours a surface, in its unit: at the multiples of an
// interval, at levels, or both.
struct ContoursView {
  std::optional<double> interval;      // empty: levels only
  double line_width = 1;               // pixels at a picture height of 720
  std::string line_color = "#000000";  // sRGB
  std::vector<double> levels;          // ascending
  bool operator==(const ContoursView&) const = default;
};

// An isosurface of a field, or its section by a layer or a plane: exactly one of the three is set.
struct SurfaceView {
  std::string field;
  std::optional<double> isovalue;
  std::optional<SliceView> slice;
  std::optional<PlaneView> plane;
  double opacity = 1;
  SurfaceColorView color;
  std::optional<ContoursView> contours;
  bool operator==(const SurfaceView&) const = default;
};

// An opaque surface: a terrain, a globe within the shell of a sphere, or the bottom of the box. The
// rest of the keys have an effect only where its places on the Earth are known.
struct GroundView {
  GroundShow show = GroundShow::automatic;  // automatic: on a sphere, and below data of the Earth
  std::string surface_color = "#2b3a4d";    // sRGB, without `tint`
  bool tint = true;
  std::string land_color = "#3f4a3c";  // sRGB
  std::string sea_color = "#22324a";   // sRGB
  std::string line_color = "#b4c0c8";  // sRGB
  bool coastlines = true;
  bool borders = false;
  bool graticule = false;
  bool operator==(const GroundView&) const = default;
};

// What is subtracted from the fields: those of another dataset, of another step, or both.
struct DifferenceView {
  std::optional<std::string> dataset;  // empty: that of the view
  std::optional<int> step;             // empty: that of the view
  bool operator==(const DifferenceView&) const = default;
};

struct View {
  std::string dataset;
  int step = 0;
  std::optional<DifferenceView> difference;  // empty: fields as they are
  CameraView camera;
  ImageView image;
  GeometryView geometry;
  GroundView ground;
  VectorView vector;
  std::optional<std::vector<ScalarView>> scalars;
  DepthCueView depth_cue;
  MethodView method;
  QualityView quality;
  AnnotationsView annotations;
  RegionView region;
  std::optional<LightView> light;  // empty: colours as in the legend
  std::vector<SurfaceView> surfaces;
  bool operator==(const View&) const = default;
};

}  // namespace windsplat::protocol
