"""Types of the parts of a view, and the methods that set them.

Written by generate_view_types.py from protocol/view.schema.json.
"""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Mapping, Sequence, TypedDict

if TYPE_CHECKING:
    from typing_extensions import Self

UNSET: Any = ...  # a keyword that was not given; None is a value: the default of the dataset


class DifferenceView(TypedDict, total=False):
    """What is subtracted: wherever the view names a field, except in `geometry.heightField`, it
    means the field of the view's dataset and step minus the same field here. At least one of the
    two keys has to be given. The grids have to be the same, and of each field that is shown the
    units. Samples that are missing in either are missing. null: fields as they are."""

    dataset: str | None
    """Id of the dataset that is subtracted, for example one that shows another member. null: the
    dataset of the view."""
    step: int | None
    """Time step that is subtracted, counted from 0. null: the step of the view."""


class CameraView(TypedDict, total=False):
    """Position and projection of the camera."""

    projection: Literal["perspective", "orthographic"] | None
    """perspective: distant parts are smaller. orthographic: parallel projection. Default:
    perspective; orthographic where the default camera looks along the normal of a slice, a plane
    or data of one layer (see `eye`), so that ground and ticks are not displaced against it."""
    eye: Sequence[float] | None
    """Position of the eye, world units. Default: the dataset's, which shows the whole box; with a
    flat slice or a plane, and no `target` either, one that looks along its normal at its part in
    the box."""
    target: Sequence[float] | None
    """The point at the centre of the picture, world units. Default: the centre of the box, or of
    what the default eye faces."""
    up: Sequence[float]
    """Upward direction of the picture; any length of at least 1e-6, not parallel to the view
    direction. A default eye that looks along it has north up."""
    fovY: float
    """Vertical field of view, degrees; perspective only."""
    height: float | None
    """Height of the picture at the target, world units; orthographic only. Default: shows what
    the default eye shows."""


class ImageView(TypedDict, total=False):
    """Size and background of the picture."""

    width: int
    """Pixels."""
    height: int
    """Pixels."""
    background: str
    """sRGB colour behind the volume."""


class SliceView(TypedDict, total=False):
    """Draws a single layer of the grid, or one between two of its layers: only its samples, and
    of vectors the part within its plane. null: the whole grid."""

    axis: Literal["x", "y", "z"]
    """The axis of the grid normal to the layer."""
    index: float
    """Index of the layer in grid samples, from 0 (west, south or bottom). Between two layers,
    positions and values are interpolated; a sample is masked if either of the two is."""


class PlaneView(TypedDict, total=False):
    """Draws the samples of a plane through the grid, and of vectors the part within it. Values
    are interpolated; a sample is masked if any sample with a share in it is. Not with `slice`,
    `heightField` or a mapping other than flat. null: the whole grid, or the slice."""

    point: Sequence[float]
    """A point of the plane in world units: the longest edge of the box is 2, its centre the
    origin."""
    normal: Sequence[float]
    """The direction normal to the plane in the world, of a length of at least 1e-6; the length
    has no effect."""


class GeometryView(TypedDict, total=False):
    """Placement of the grid in the world."""

    scale: Sequence[float]
    """Scale factors of the edges of the box (x, y, z). On a sphere, z scales the thickness of the
    shell; x and y have no effect. The widest cell of the scaled grid may be at most 1e7 times as
    wide as the narrowest."""
    vertical: Literal["auto", "linear", "logp", "index", "metric"]
    """Spacing of the vertical axis: auto (logarithm of pressure for a pressure axis, otherwise
    the coordinate), linear (the coordinate), logp (logarithm of pressure), index (uniform),
    metric (the coordinate, to the scale of the horizontal axes; requires units of length,
    horizontally also degrees). With the others, heights are exaggerated in boxes of degrees and
    in those flatter than 0.05 of their longest horizontal edge."""
    mapping: Literal["flat", "curvilinear", "sphere"]
    """Mapping of the grid to the world: flat (a box), curvilinear (a flat map with every column
    at its own longitude and latitude; requires 2-D longitude and latitude), or sphere (a globe of
    radius 1 about the origin, north pole up; requires longitude and latitude)."""
    heightField: str | None
    """Name of a scalar field with the height of each sample, for terrain-following grids. Its
    values at the first step replace the vertical coordinate; of `vertical` only `metric` has an
    effect. null: use the vertical coordinate."""
    slice: SliceView | None
    """Draws a single layer of the grid, or one between two of its layers: only its samples, and
    of vectors the part within its plane. null: the whole grid."""
    plane: PlaneView | None
    """Draws the samples of a plane through the grid, and of vectors the part within it. Values
    are interpolated; a sample is masked if any sample with a share in it is. Not with `slice`,
    `heightField` or a mapping other than flat. null: the whole grid, or the slice."""


class GroundView(TypedDict, total=False):
    """An opaque surface that hides what lies behind it. On a sphere, a globe just inside the
    lowest cells; otherwise a rectangle at the bottom of the box. With show on, the terrain or sea
    floor takes the place of the rectangle and is added to the globe: the ground of the file
    (`ground` of the dataset) if heights above sea level are drawn, by heightField or the vertical
    axis, otherwise with heightField the bottom of the lowest cells, except on levels of pressure
    or of constant height. Where the data have longitudes and latitudes it shows the Earth, by the
    coastlines and borders of Natural Earth, exact to 0.015 degrees; elsewhere it has
    surfaceColor."""

    show: Literal["auto", "on", "off"]
    """Whether the ground is drawn: on, off, or auto: a sphere, and seen from above a flat map of
    data with longitudes and latitudes for every column, of one layer, or with lines, or of levels
    that are not those of a sea. auto draws no terrain."""
    surfaceColor: str
    """sRGB colour of the ground where it faces the viewer, without tint or without places on the
    Earth; down to 0.6 of that light where it is seen edge-on, and on terrain from half to 1.35 of
    it by the slope."""
    tint: bool
    """Land and sea have colours of their own."""
    landColor: str
    """sRGB colour of land, with tint."""
    seaColor: str
    """sRGB colour of the sea, with tint."""
    lineColor: str
    """sRGB colour of coastlines, borders and graticule."""
    coastlines: bool
    """Coastlines, 1.2 pixels wide in a picture of 720 lines and in proportion in others."""
    borders: bool
    """Borders of countries, as Natural Earth has them."""
    graticule: bool
    """Meridians and parallels every 1, 2, 5, 10 or 30 degrees, by the scale of the picture."""


class MarkView(TypedDict, total=False):
    """How lines show their direction and their order in depth. Streamlets (`trace`) have no
    marks."""

    shape: Literal["line", "taper", "arrow", "comet"]
    """line (constant width), taper (twice as wide at the tail, a point at the head), arrow (a
    line with a triangular head) or comet (a line with a dark tail, in the hue of the colour map).
    A taper covers the area of a line."""
    headWidth: float
    """Width of the head of an arrow, in pixels at a picture height of 720."""
    headLength: float
    """Length of the head of an arrow, in pixels at a picture height of 720. It is part of the
    length of the line, at most half of it; a shorter head is narrower in proportion."""
    tailDarkening: float | None
    """Part of the light that the tail of a line lacks, whatever its shape; it falls linearly to
    none at the head: 0 none, 1 black. Default: 0.85 for comets, and for plain lines without white
    heads by default or of true colours, except those of true colours through seeds, whose
    magnitude is read along them; otherwise 0."""
    halo: float
    """Width of a rim without light around each line, which separates it from what lies behind, in
    pixels at a picture height of 720; 0: none."""


class VectorColorView(TypedDict, total=False):
    """Colours of lines."""

    by: Literal["worldZ", "screenZ", "rise", "magnitude", "direction", "scalar", "constant"] | None
    """Quantity shown by colour: worldZ (height in the world; on a curved grid the height of the
    level), screenZ (distance from the eye along the view direction), rise (the height that the
    line gains from its tail to its head, weighted against the height of its position), magnitude,
    direction (compass bearing of the vector), scalar (value of the scalar field `field`), or
    constant (a single colour). Default: the dataset's; in a slice or plane magnitude."""
    map: str
    """Name of a colour map; see GET /v1/colormaps."""
    field: str | None
    """Name of a scalar field; required by `scalar`, otherwise unused."""
    range: Sequence[float] | None
    """Values at the two ends of the map: world units for worldZ, screenZ and rise (for rise,
    heights from the bottom to the top of the box count as rises from the lower end to the
    higher), degrees for direction (0 north, 90 east), the unit of the field for magnitude and
    scalar. The ends must differ; a descending range reverses the map. Default: the dataset's."""
    riseWeight: float
    """For `rise`: weight of the rise, from 0 (height only) to 1 (rise only)."""
    constant: str
    """For `constant`: the sRGB colour."""
    trueColors: bool
    """Draws lines in the hues of the map as its legend shows them: vector.headDesaturation,
    vector.magnitudeIntensity and depthCue do not apply, and plain lines that are not followed
    from seeds point to their bright end, see vector.mark.tailDarkening."""


class MotionView(TypedDict, total=False):
    """Movement of the texture of lines."""

    mode: Literal["still", "phase"]
    """still: no movement. phase: opacity fades along each line and moves towards its head, which
    shows the flow."""
    rate: float
    """Speed of the movement in cycles per step at the top of magnitudeRange, proportionally less
    below. No effect if mode is still."""
    time: float
    """Time of the movement in steps, added to the step. No effect if mode is still."""


class JitterView(TypedDict, total=False):
    """Random displacement of kernels and lines that hides the regular grid."""

    center: float
    """Range of the displacement of the centre of a line in its kernel, in strides."""
    stride: float
    """Range of the displacement of the kernel, in strides."""
    overlap: bool
    """true: kernels are `span` strides wide and overlap. false: one stride wide."""
    seed: int
    """Seed of the random pattern."""
    perStep: bool
    """true: a new random pattern at each time step."""


SeedLineView = TypedDict(
    "SeedLineView",
    {
        # The first seed, in the coordinates of the axes.
        "from": "Sequence[float]",
        # The last seed.
        "to": "Sequence[float]",
        # Number of seeds; one is in the middle.
        "count": "int",
    },
    total=False,
)


SeedBlockView = TypedDict(
    "SeedBlockView",
    {
        # A corner of the box, in the coordinates of the axes.
        "from": "Sequence[float]",
        # The corner opposite.
        "to": "Sequence[float]",
        # Numbers of seeds along x, y and z; one is in the middle.
        "counts": "Sequence[int]",
    },
    total=False,
)


class SeedsView(TypedDict, total=False):
    """Lines through these places in place of one for each sample: streamlines, or paths through
    time (`pathSteps`). They have local magnitudes, and minMagnitude hides no part of them.
    `segments`, `jitter`, `stride` and `vector.length` have no effect. At most 5000 seeds of all
    kinds together. null: a line for each sample."""

    evenly: int | None
    """Number of seeds that fill the data, or their region, evenly. null: 100, or none if there
    are other seeds."""
    points: Sequence[Sequence[float]]
    """Seeds in the coordinates of the axes that the description of the dataset lists; longitude,
    latitude and the vertical coordinate on grids with 2-D longitudes and latitudes. Along an axis
    of one sample any number. Between samples coordinates are linear. A seed outside of the data
    is refused; one in a masked cell has no line."""
    line: SeedLineView | None
    """Seeds at equal distances from one end of a line to the other. null: none."""
    block: SeedBlockView | None
    """Seeds at equal distances along the axes, in a box or, with one along an axis, in a plane.
    null: none."""
    length: float | None
    """Length of a streamline on each side of its seed, world units. null: the diagonal of the
    box."""
    duration: float | None
    """How long the flow is followed to each side of a seed: seconds with vector.space world,
    otherwise world units over the unit of the field. null: any time."""
    pathSteps: int
    """Paths of particles that are at their seeds at the step of the view: followed back and ahead
    through so many steps, as far as the series goes, with components linear in time between
    steps. Requires vector.space world and steps with a unit of time. 0: streamlines of the step."""
    pieces: int
    """The largest number of straight pieces of a line. A line has as few as keep to the curve
    within 1/4000 of the diagonal of the box and are no longer than 1/100 of it."""
    dash: float
    """Length of a dash with its gap where the flow at a seed has the top of magnitudeRange, world
    units; proportional to the magnitude there, and along a line to the speed. Dashes are drawn
    with motion.mode phase, and move by motion.rate dashes a step."""


class TraceView(TypedDict, total=False):
    """Streamlets: every line is the part of the streamline through its centre that has the length
    of the straight line, half of it upstream and half downstream, and it is not clipped to its
    kernel (`span`, `jitter.overlap`). With `seeds`: lines through them. It ends earlier at a
    masked cell, at the boundary, where the flow stagnates, and after 10000 steps of integration
    upstream or downstream, which only a very small `stepError` or a line of thousands of cells
    takes; frame reports count these in `work.streamlets.ends.steps`. Every sample of the stride
    is drawn, whatever the detail. Not with a slice or plane, and without arrow heads. null:
    straight lines."""

    segments: int
    """The largest number of straight pieces of a line. A line has as few as depart from the curve
    by less than 1/200 of its length."""
    stepError: float
    """Bound of the estimated error of each step of the integration, in grid cells. The steps of a
    line grow in number with the fifth root of its inverse; at most 10000 are taken."""
    seeds: SeedsView | None
    """Lines through these places in place of one for each sample: streamlines, or paths through
    time (`pathSteps`). They have local magnitudes, and minMagnitude hides no part of them.
    `segments`, `jitter`, `stride` and `vector.length` have no effect. At most 5000 seeds of all
    kinds together. null: a line for each sample."""


class VectorView(TypedDict, total=False):
    """The vector field and its lines."""

    field: str | None
    """Name of a vector field; null draws no lines. Default: the dataset's first vector field; if
    its components differ in unit, its conversion (wind_m) where there is one. In a merge patch
    null here is kept as a value; to return to the default, remove `vector` or name the field."""
    space: Literal["components", "world"]
    """Direction of lines: components (that of the data; omega reversed so that rising air points
    up) or world (transformed like positions, so that lines are tangent to trajectories in the
    picture)."""
    scale: Sequence[float]
    """Scale factors of the components for the direction of lines. Lengths and colours use the
    unscaled magnitude."""
    length: float | None
    """Length of a line at the top of magnitudeRange, world units. Default: the dataset's, with
    which lines stay apart at the default stride."""
    span: float
    """Width of a kernel, in grid strides. Lines are clipped to it."""
    stride: int | None
    """Distance between kernels, grid samples. Default: the smallest with which the lines of the
    whole box stay apart in a picture of the default size."""
    r1: float
    """Distance from the centre of a line up to which it has full opacity, in pixels at a picture
    height of 720; at most r2."""
    r2: float
    """Distance from the centre of a line at which its opacity reaches zero, in pixels at a
    picture height of 720; at least r1."""
    opacity: float
    """Opacity of lines, from 0 to 1."""
    combine: Literal["over", "or"]
    """How the lines of a slice or plane combine where they overlap: over (the nearer over the
    farther, each at its depth in the medium) or or (the largest opacity, and of each channel the
    largest light, laid over the medium: overlapping lines do not accumulate). Without a slice or
    plane always over."""
    headDesaturation: float | None
    """Desaturation of the heads of lines: 0 none, 1 grey. Comets keep the hue of the colour map.
    Default: 0.7; 0 for plain lines over a dark background in colours on which it can hardly be
    seen, which then have dark tails (vector.mark.tailDarkening)."""
    mark: MarkView
    """How lines show their direction and their order in depth. Streamlets (`trace`) have no
    marks."""
    color: VectorColorView
    """Colours of lines."""
    magnitudeRange: Sequence[float] | None
    """Magnitudes at the ends of the brightness scale, in the unit of the field, ascending; lines
    reach full length at the upper end. Default: the dataset's."""
    minMagnitude: float | None
    """Vectors of a smaller magnitude are not drawn; in the unit of the field. Default: the
    dataset's."""
    magnitudeIntensity: float
    """Dependence of brightness on magnitude: 0 none, 1 black at the lower end of magnitudeRange."""
    motion: MotionView
    """Movement of the texture of lines."""
    jitter: JitterView
    """Random displacement of kernels and lines that hides the regular grid."""
    trace: TraceView | None
    """Streamlets: every line is the part of the streamline through its centre that has the length
    of the straight line, half of it upstream and half downstream, and it is not clipped to its
    kernel (`span`, `jitter.overlap`). With `seeds`: lines through them. It ends earlier at a
    masked cell, at the boundary, where the flow stagnates, and after 10000 steps of integration
    upstream or downstream, which only a very small `stepError` or a line of thousands of cells
    takes; frame reports count these in `work.streamlets.ends.steps`. Every sample of the stride
    is drawn, whatever the detail. Not with a slice or plane, and without arrow heads. null:
    straight lines."""


class ScalarColorView(TypedDict, total=False):
    """Colours of the medium."""

    map: str | None
    """Name of a colour map; see GET /v1/colormaps. Default: the dataset's."""
    range: Sequence[float] | None
    """Values at the two ends of the map, in the unit of the field. The ends must differ; a
    descending range reverses the map. Default: the dataset's."""


class ScalarView(TypedDict, total=False):
    """One scalar field drawn as a medium."""

    field: str
    """Name of a scalar field."""
    color: ScalarColorView
    """Colours of the medium."""
    extinction: Sequence[Sequence[float]] | None
    """Extinction function as points (value, extinction): values in the unit of the field, not
    descending (two equal values form a step; others lie at least 1e-30 apart); extinction per
    world unit. Linear between points, constant beyond the first and last. Default: the dataset's;
    opaque in a slice or plane that has no lines, or lines that are laid over the media
    (vector.combine or)."""
    minOpticalDepth: float
    """Splats of a smaller optical depth are skipped."""
    stride: int
    """Distance between splats, grid samples."""
    shading: Literal["scatter", "gradient", "none"]
    """In a view with light: scatter, by the sunlight that arrives, for clouds and smoke;
    gradient, by the angle between the gradient of the field and the sun, for fields that are no
    clouds; none, colours as in the legend."""


class DepthCueView(TypedDict, total=False):
    """Darkening of lines with distance from the eye."""

    strength: float
    """Darkening at `far`: 0 none, 1 black."""
    near: float
    """Depth at which darkening begins: 0 is the point of the volume nearest to the eye, 1 the
    farthest. Less than far."""
    far: float
    """Depth at which darkening is complete: 0 is the point of the volume nearest to the eye, 1
    the farthest. Greater than near."""


class MethodView(TypedDict, total=False):
    """Rendering method and its parameters."""

    name: Literal["kernel", "slab", "reference"]
    """kernel: composites kernels one by one in visibility order. slab: divides the volume into
    slabs of constant depth and composites the parts of kernels within each. reference: evaluates
    the rendering integral per pixel, which takes seconds to minutes; available on the command
    line, rejected in requests and streams. With slab, a stream may render moving frames by
    kernel; the frame reports its method."""
    compositing: Literal["simple", "cd-naive", "cd", "analytic", "cd-euler"]
    """Compositing of a line in a homogeneous piece of medium: simple (line behind the whole
    piece), cd-naive (front part, line and back part in sequence; leaves seams around lines), cd
    (cd-naive corrected, linear in the position of the line), analytic (exact), cd-euler (optical
    depth used as opacity; diverges in dense media). Ignored by method reference."""
    slabThickness: float
    """For method slab: thickness of slabs, in grid cells along the view direction."""
    stopTransmittance: float
    """Early termination: rendering of a pixel block ends when its transmittance falls to this
    value. 0: never."""
    detail: Literal["auto", "full"]
    """auto: axes of which two samples fit in a pixel at the nearest point of the volume are
    halved once by merging samples, but no more lines than one line can represent by its opacity;
    the variant of the frame reports how often. full: every sample is drawn. Method reference,
    curved grids, media with a stride, and lines with a stride without a medium always use full.
    Beside a medium, lines with a stride keep their samples, places and lengths at a level no
    wider than the stride."""


class QualityView(TypedDict, total=False):
    """Limits within which the server chooses resolution, method and slab thickness."""

    budgetMs: float | None
    """Time budget for rendering and encoding a picture or a moving frame, in milliseconds; the
    final frame of a stream has none. The server chooses the setting with the least error within
    the budget, possibly a smaller picture (the frame reports its size), without thinner slabs
    than the view's. Estimated for JPEG; PNG and NPY take longer to encode. null: 33 for moving
    frames of a stream, otherwise no limit."""
    maxError: float | None
    """Largest error of a picture before encoding, as linear RMSE. The server chooses the fastest
    setting expected to satisfy it for 95 % of pictures, possibly a smaller picture (the frame
    reports its size). Slabs may be thinner than the view's, or replace its method `kernel`,
    except in moving frames of a stream. budgetMs has precedence. If no setting satisfies it, the
    most accurate one is used, and the frame reports its error. null: no limit."""
    lossless: bool
    """Final frames of a stream are encoded as PNG instead of JPEG."""


class BoxStyleView(TypedDict, total=False):
    """Size and colour of the edges of the box."""

    size: float
    """Factor of the size, multiplied by that of all annotations; together at most 4."""
    textColor: str | None
    """sRGB colour of lines and texts. null: that of all annotations."""


class AxesStyleView(TypedDict, total=False):
    """Size and colour of ticks, their values and the names of axes."""

    size: float
    """Factor of the size, multiplied by that of all annotations; together at most 4."""
    textColor: str | None
    """sRGB colour of lines and texts. null: that of all annotations."""


class NorthStyleView(TypedDict, total=False):
    """Size and colour of the arrow to the north."""

    size: float
    """Factor of the size, multiplied by that of all annotations; together at most 4."""
    textColor: str | None
    """sRGB colour of lines and texts. null: that of all annotations."""


class ScaleBarStyleView(TypedDict, total=False):
    """Size and colour of the scale bar."""

    size: float
    """Factor of the size, multiplied by that of all annotations; together at most 4."""
    textColor: str | None
    """sRGB colour of lines and texts. null: that of all annotations."""


class LegendStyleView(TypedDict, total=False):
    """Size and colour of the legend, whose size is limited by the width of the picture."""

    size: float
    """Factor of the size, multiplied by that of all annotations; together at most 4."""
    textColor: str | None
    """sRGB colour of lines and texts. null: that of all annotations."""


class TitleStyleView(TypedDict, total=False):
    """Size and colour of the title."""

    size: float
    """Factor of the size, multiplied by that of all annotations; together at most 4."""
    textColor: str | None
    """sRGB colour of lines and texts. null: that of all annotations."""


class StepTimeStyleView(TypedDict, total=False):
    """Size and colour of time and step, and what a difference subtracts."""

    size: float
    """Factor of the size, multiplied by that of all annotations; together at most 4."""
    textColor: str | None
    """sRGB colour of lines and texts. null: that of all annotations."""


class AnnotationsView(TypedDict, total=False):
    """What is drawn and written around the data, in every picture but NPY. Each part is left out
    where it has nothing to tell. They change no measured error."""

    box: bool
    """The edges of the box that contains the data, those at the back behind the data. Not on a
    sphere."""
    axes: bool
    """Ticks along the outline of the box with values in the coordinates of the data, at their
    true places, and the names and units of the axes; with the box, lines on its far sides that
    continue them. Not on a sphere."""
    north: bool
    """An arrow to the north at the centre of the picture, for data with longitudes and latitudes."""
    scaleBar: bool
    """A bar of a round length on the ground, across the line of sight at the centre of the box."""
    legend: bool
    """The meaning of the colours, the length of the longest line, and the opacity of each medium."""
    title: bool
    """The title of the dataset."""
    stepTime: bool
    """The time of the step and its number, counted from 1."""
    contourLabels: bool
    """The values of the contours of surfaces, along the lines. Not where another surface or the
    ground hides them, and not over other texts."""
    size: float
    """Factor of the size of texts and lines. At 1 a picture of 1280 x 720 has texts of 14 pixels;
    smaller ones have smaller texts."""
    textColor: str | None
    """sRGB colour of lines and texts. null: one that contrasts with the background."""
    titleText: str | None
    """A title of one's own in place of that of the dataset, shown by `title`: one line, cut short
    where it does not fit. Control characters of Unicode and line separators are refused, and
    characters that the font, DejaVu Sans, lacks. null: the title of the dataset."""
    boxStyle: BoxStyleView
    """Size and colour of the edges of the box."""
    axesStyle: AxesStyleView
    """Size and colour of ticks, their values and the names of axes."""
    northStyle: NorthStyleView
    """Size and colour of the arrow to the north."""
    scaleBarStyle: ScaleBarStyleView
    """Size and colour of the scale bar."""
    legendStyle: LegendStyleView
    """Size and colour of the legend, whose size is limited by the width of the picture."""
    titleStyle: TitleStyleView
    """Size and colour of the title."""
    stepTimeStyle: StepTimeStyleView
    """Size and colour of time and step, and what a difference subtracts."""


class FilterView(TypedDict, total=False):
    """One filter."""

    field: str
    """Name of a scalar field."""
    range: Sequence[float]
    """Lowest and highest value that is drawn, in the unit of the field."""
    of: Literal["lines", "media", "all"]
    """What is filtered: lines, media, or all of them and surfaces."""


class RegionView(TypedDict, total=False):
    """The part of the data that is drawn: the samples that satisfy every key. Others are neither
    read for the picture nor computed, and box, annotations and the default camera follow those
    that are left. Placement in the world and the jitter of lines stay those of the whole grid;
    but in a region across the seam of an axis of longitudes the columns east of it count on, on a
    flat map beyond the eastern edge, and their lines have another jitter."""

    x: Sequence[float] | None
    """Range of the x axis (low, high), both ends included, in the coordinates that the
    description of the dataset lists. On an axis of longitudes from west to east, whatever turn of
    the globe they count from: (350, 10) and (-10, 10) are the same. Other axes take the ends in
    either order. null: all."""
    y: Sequence[float] | None
    """Range of the y axis. null: all."""
    z: Sequence[float] | None
    """Range of the vertical axis; with heightField still that of the axis of the data. null: all."""
    longitudes: Sequence[float] | None
    """Columns between these longitudes, degrees from west to east, by their own positions on
    grids with 2-D longitudes and latitudes. Requires longitudes and latitudes. null: all."""
    latitudes: Sequence[float] | None
    """Columns between these latitudes, degrees. null: all."""
    where: Sequence[FilterView]
    """Filters by other fields at the same step: a sample is treated as masked where one of them
    is beyond its range or masked. Decided for every sample of the data, before a level of detail
    is formed."""
    polygon: Mapping[str, Any] | None
    """Columns within a polygon: a GeoJSON geometry (RFC 7946) of type Polygon or MultiPolygon,
    with at most 2000 positions, in longitudes and latitudes, without them in x and y. Edges are
    straight in these coordinates; a longitude is that of any turn of the globe. A column is
    inside by the even-odd rule over the rings of a polygon, so that further rings are holes; on
    an edge it is inside. null: all."""


class SunAtView(TypedDict, total=False):
    """Places the sun where it is at a time and place, instead of azimuth and elevation. null: by
    those. On a sphere the time alone counts."""

    utc: str
    """Time in UTC, for example 2024-06-21T12:00:00Z; seconds may be left out."""
    longitude: float
    """Degrees east."""
    latitude: float
    """Degrees north."""


class LightView(TypedDict, total=False):
    """A sun whose light the media scatter once and throw shadows in, also on lines. Lit colours
    are darker than those of the legend. null: none. Slices and planes are drawn without it."""

    azimuth: float
    """Direction of the sun: degrees clockwise from north (+y in the world)."""
    elevation: float
    """Degrees of the sun above the horizon, in the picture: heights are often exaggerated. Below
    0 there is only ambient light. On a sphere the sun is over the latitude `elevation` and the
    longitude 180 - `azimuth`."""
    sunAt: SunAtView | None
    """Places the sun where it is at a time and place, instead of azimuth and elevation. null: by
    those. On a sphere the time alone counts."""
    ambient: float
    """Part of each colour that needs no sun."""
    brightness: float
    """Of the sun, relative to one that lights a thin medium in the colours of the legend. Where
    it would exceed them, light is cut off."""
    shadows: float
    """Factor of the extinctions on the way of the sunlight. Media are usually drawn thinner than
    they are, so that one sees into them, and would throw hardly a shadow; 1: the same for light
    and picture."""
    anisotropy: float
    """Mean cosine of the angle of scattering (phase function of Henyey and Greenstein): 0 all
    directions alike, positive forward, so that clouds before the sun shine, negative backward."""


class SurfaceColorView(TypedDict, total=False):
    """Colours of the surface."""

    map: str
    """Name of a colour map; see GET /v1/colormaps."""
    field: str | None
    """Name of the scalar field whose values colour the surface. null: the field of a section; an
    isosurface has the colour `constant`. Where it is masked the surface is grey."""
    range: Sequence[float] | None
    """Values at the two ends of the map, in the unit of the field. The ends must differ; a
    descending range reverses the map. Default: that of the field at the first step, or at a later
    one if it is constant there."""
    constant: str
    """sRGB colour of an isosurface without a field of colours."""


class ContoursView(TypedDict, total=False):
    """Lines of constant value of the field that colours the surface, at the multiples of
    `interval`, at `levels`, or at both. null: none."""

    interval: float | None
    """Difference of the values of neighbouring lines, which are multiples of it, in the unit of
    the field. null: lines at `levels` only."""
    levels: Sequence[float]
    """Values of lines, in the unit of the field, ascending; beside those of `interval`, or
    without it."""
    lineWidth: float
    """Width of the lines, in pixels at a picture height of 720."""
    lineColor: str
    """sRGB colour of the lines."""


class SurfaceView(TypedDict, total=False):
    """An isosurface, or a section by a layer or a plane: exactly one of `isovalue`, `slice` and
    `plane` is set. Cells with a masked sample are left open; along a layer of samples only those
    of the layer count."""

    field: str
    """Name of the scalar field that is cut."""
    isovalue: float | None
    """The value of an isosurface, in the unit of the field. It is lit from the eye, and in a view
    with `light` by the sun."""
    slice: SliceView | None
    """A section by a layer of the grid, or one between two of its layers."""
    plane: PlaneView | None
    """A section by a plane; values are interpolated linearly."""
    opacity: float
    """Opacity of the surface, seen at any angle."""
    color: SurfaceColorView
    """Colours of the surface."""
    contours: ContoursView | None
    """Lines of constant value of the field that colours the surface, at the multiples of
    `interval`, at `levels`, or at both. null: none."""


class ViewDocument(TypedDict, total=False):
    """Everything that determines a picture except its encoding. All keys are optional. A key
    without a static default has the dataset's default, listed as `defaultView` by GET
    /v1/datasets/{id}; null selects that default where allowed, except at /vector/field. Lengths
    are in world units: the longest edge of the data box is 2, its centre is the origin, x points
    east, y north, z up. Constraints beyond this schema: image.width * image.height <= 35389440;
    the length of camera.up is at least 1e-6; vector.r1 <= vector.r2; the ends of a colour range
    differ by at least 1e-30, and a descending range reverses the map; vector.magnitudeRange
    ascends by at least 1e-30; the values of extinction points do not descend (two equal values
    form a step); depthCue.near < depthCue.far."""

    dataset: str
    """Id of the dataset. Empty: the one named by the request or session."""
    step: int
    """Time step, counted from 0."""
    difference: DifferenceView | None
    """What is subtracted: wherever the view names a field, except in `geometry.heightField`, it
    means the field of the view's dataset and step minus the same field here. At least one of the
    two keys has to be given. The grids have to be the same, and of each field that is shown the
    units. Samples that are missing in either are missing. null: fields as they are."""
    camera: CameraView
    """Position and projection of the camera."""
    image: ImageView
    """Size and background of the picture."""
    geometry: GeometryView
    """Placement of the grid in the world."""
    ground: GroundView
    """An opaque surface that hides what lies behind it. On a sphere, a globe just inside the
    lowest cells; otherwise a rectangle at the bottom of the box. With show on, the terrain or sea
    floor takes the place of the rectangle and is added to the globe: the ground of the file
    (`ground` of the dataset) if heights above sea level are drawn, by heightField or the vertical
    axis, otherwise with heightField the bottom of the lowest cells, except on levels of pressure
    or of constant height. Where the data have longitudes and latitudes it shows the Earth, by the
    coastlines and borders of Natural Earth, exact to 0.015 degrees; elsewhere it has
    surfaceColor."""
    vector: VectorView
    """The vector field and its lines."""
    scalars: Sequence[ScalarView] | None
    """The media, one per scalar field; their extinctions add. An empty array draws none. Default:
    the dataset's."""
    depthCue: DepthCueView
    """Darkening of lines with distance from the eye."""
    method: MethodView
    """Rendering method and its parameters."""
    quality: QualityView
    """Limits within which the server chooses resolution, method and slab thickness."""
    annotations: AnnotationsView
    """What is drawn and written around the data, in every picture but NPY. Each part is left out
    where it has nothing to tell. They change no measured error."""
    region: RegionView
    """The part of the data that is drawn: the samples that satisfy every key. Others are neither
    read for the picture nor computed, and box, annotations and the default camera follow those
    that are left. Placement in the world and the jitter of lines stay those of the whole grid;
    but in a region across the seam of an axis of longitudes the columns east of it count on, on a
    flat map beyond the eastern edge, and their lines have another jitter."""
    light: LightView | None
    """A sun whose light the media scatter once and throw shadows in, also on lines. Lit colours
    are darker than those of the legend. null: none. Slices and planes are drawn without it."""
    surfaces: Sequence[SurfaceView] | None
    """Isosurfaces and sections of scalar fields, each with an opacity, drawn at their depth among
    lines and media. They need at least two samples along every axis, and always show every
    sample. null or an empty array: none."""


class ViewParts:
    """One method for each part of the view; each returns a new view."""

    def _merged(self, key: str, given: Mapping[str, Any]) -> Self:
        raise NotImplementedError

    def _listed(self, key: str, items: Sequence[Any]) -> Self:
        raise NotImplementedError

    def difference(
        self,
        *,
        dataset: str | None = UNSET,
        step: int | None = UNSET,
    ) -> Self:
        """What is subtracted: wherever the view names a field, except in `geometry.heightField`,
        it means the field of the view's dataset and step minus the same field here. At least one
        of the two keys has to be given. The grids have to be the same, and of each field that is
        shown the units. Samples that are missing in either are missing. null: fields as they are.

        dataset: Id of the dataset that is subtracted, for example one that shows another member.
            null: the dataset of the view.
        step: Time step that is subtracted, counted from 0. null: the step of the view.
        """
        return self._merged("difference", {"dataset": dataset, "step": step})

    def camera(
        self,
        *,
        projection: Literal["perspective", "orthographic"] | None = UNSET,
        eye: Sequence[float] | None = UNSET,
        target: Sequence[float] | None = UNSET,
        up: Sequence[float] = UNSET,
        fovY: float = UNSET,
        height: float | None = UNSET,
    ) -> Self:
        """Position and projection of the camera.

        projection: perspective: distant parts are smaller. orthographic: parallel projection.
            Default: perspective; orthographic where the default camera looks along the normal of
            a slice, a plane or data of one layer (see `eye`), so that ground and ticks are not
            displaced against it.
        eye: Position of the eye, world units. Default: the dataset's, which shows the whole box;
            with a flat slice or a plane, and no `target` either, one that looks along its normal
            at its part in the box.
        target: The point at the centre of the picture, world units. Default: the centre of the
            box, or of what the default eye faces.
        up: Upward direction of the picture; any length of at least 1e-6, not parallel to the view
            direction. A default eye that looks along it has north up.
        fovY: Vertical field of view, degrees; perspective only.
        height: Height of the picture at the target, world units; orthographic only. Default:
            shows what the default eye shows.
        """
        return self._merged("camera", {"projection": projection, "eye": eye, "target": target,
            "up": up, "fovY": fovY, "height": height})

    def image(
        self,
        *,
        width: int = UNSET,
        height: int = UNSET,
        background: str = UNSET,
    ) -> Self:
        """Size and background of the picture.

        width: Pixels.
        height: Pixels.
        background: sRGB colour behind the volume.
        """
        return self._merged("image", {"width": width, "height": height, "background": background})

    def geometry(
        self,
        *,
        scale: Sequence[float] = UNSET,
        vertical: Literal["auto", "linear", "logp", "index", "metric"] = UNSET,
        mapping: Literal["flat", "curvilinear", "sphere"] = UNSET,
        heightField: str | None = UNSET,
        slice: SliceView | None = UNSET,
        plane: PlaneView | None = UNSET,
    ) -> Self:
        """Placement of the grid in the world.

        scale: Scale factors of the edges of the box (x, y, z). On a sphere, z scales the
            thickness of the shell; x and y have no effect. The widest cell of the scaled grid may
            be at most 1e7 times as wide as the narrowest.
        vertical: Spacing of the vertical axis: auto (logarithm of pressure for a pressure axis,
            otherwise the coordinate), linear (the coordinate), logp (logarithm of pressure),
            index (uniform), metric (the coordinate, to the scale of the horizontal axes; requires
            units of length, horizontally also degrees). With the others, heights are exaggerated
            in boxes of degrees and in those flatter than 0.05 of their longest horizontal edge.
        mapping: Mapping of the grid to the world: flat (a box), curvilinear (a flat map with
            every column at its own longitude and latitude; requires 2-D longitude and latitude),
            or sphere (a globe of radius 1 about the origin, north pole up; requires longitude and
            latitude).
        heightField: Name of a scalar field with the height of each sample, for terrain-following
            grids. Its values at the first step replace the vertical coordinate; of `vertical`
            only `metric` has an effect. null: use the vertical coordinate.
        slice: Draws a single layer of the grid, or one between two of its layers: only its
            samples, and of vectors the part within its plane. null: the whole grid.
        plane: Draws the samples of a plane through the grid, and of vectors the part within it.
            Values are interpolated; a sample is masked if any sample with a share in it is. Not
            with `slice`, `heightField` or a mapping other than flat. null: the whole grid, or the
            slice.
        """
        return self._merged("geometry", {"scale": scale, "vertical": vertical, "mapping": mapping,
            "heightField": heightField, "slice": slice, "plane": plane})

    def ground(
        self,
        *,
        show: Literal["auto", "on", "off"] = UNSET,
        surfaceColor: str = UNSET,
        tint: bool = UNSET,
        landColor: str = UNSET,
        seaColor: str = UNSET,
        lineColor: str = UNSET,
        coastlines: bool = UNSET,
        borders: bool = UNSET,
        graticule: bool = UNSET,
    ) -> Self:
        """An opaque surface that hides what lies behind it. On a sphere, a globe just inside the
        lowest cells; otherwise a rectangle at the bottom of the box. With show on, the terrain or
        sea floor takes the place of the rectangle and is added to the globe: the ground of the
        file (`ground` of the dataset) if heights above sea level are drawn, by heightField or the
        vertical axis, otherwise with heightField the bottom of the lowest cells, except on levels
        of pressure or of constant height. Where the data have longitudes and latitudes it shows
        the Earth, by the coastlines and borders of Natural Earth, exact to 0.015 degrees;
        elsewhere it has surfaceColor.

        show: Whether the ground is drawn: on, off, or auto: a sphere, and seen from above a flat
            map of data with longitudes and latitudes for every column, of one layer, or with
            lines, or of levels that are not those of a sea. auto draws no terrain.
        surfaceColor: sRGB colour of the ground where it faces the viewer, without tint or without
            places on the Earth; down to 0.6 of that light where it is seen edge-on, and on
            terrain from half to 1.35 of it by the slope.
        tint: Land and sea have colours of their own.
        landColor: sRGB colour of land, with tint.
        seaColor: sRGB colour of the sea, with tint.
        lineColor: sRGB colour of coastlines, borders and graticule.
        coastlines: Coastlines, 1.2 pixels wide in a picture of 720 lines and in proportion in
            others.
        borders: Borders of countries, as Natural Earth has them.
        graticule: Meridians and parallels every 1, 2, 5, 10 or 30 degrees, by the scale of the
            picture.
        """
        return self._merged("ground", {"show": show, "surfaceColor": surfaceColor, "tint": tint,
            "landColor": landColor, "seaColor": seaColor, "lineColor": lineColor, "coastlines":
            coastlines, "borders": borders, "graticule": graticule})

    def vector(
        self,
        *,
        field: str | None = UNSET,
        space: Literal["components", "world"] = UNSET,
        scale: Sequence[float] = UNSET,
        length: float | None = UNSET,
        span: float = UNSET,
        stride: int | None = UNSET,
        r1: float = UNSET,
        r2: float = UNSET,
        opacity: float = UNSET,
        combine: Literal["over", "or"] = UNSET,
        headDesaturation: float | None = UNSET,
        mark: MarkView = UNSET,
        color: VectorColorView = UNSET,
        magnitudeRange: Sequence[float] | None = UNSET,
        minMagnitude: float | None = UNSET,
        magnitudeIntensity: float = UNSET,
        motion: MotionView = UNSET,
        jitter: JitterView = UNSET,
        trace: TraceView | None = UNSET,
    ) -> Self:
        """The vector field and its lines.

        field: Name of a vector field; null draws no lines. Default: the dataset's first vector
            field; if its components differ in unit, its conversion (wind_m) where there is one.
            In a merge patch null here is kept as a value; to return to the default, remove
            `vector` or name the field.
        space: Direction of lines: components (that of the data; omega reversed so that rising air
            points up) or world (transformed like positions, so that lines are tangent to
            trajectories in the picture).
        scale: Scale factors of the components for the direction of lines. Lengths and colours use
            the unscaled magnitude.
        length: Length of a line at the top of magnitudeRange, world units. Default: the
            dataset's, with which lines stay apart at the default stride.
        span: Width of a kernel, in grid strides. Lines are clipped to it.
        stride: Distance between kernels, grid samples. Default: the smallest with which the lines
            of the whole box stay apart in a picture of the default size.
        r1: Distance from the centre of a line up to which it has full opacity, in pixels at a
            picture height of 720; at most r2.
        r2: Distance from the centre of a line at which its opacity reaches zero, in pixels at a
            picture height of 720; at least r1.
        opacity: Opacity of lines, from 0 to 1.
        combine: How the lines of a slice or plane combine where they overlap: over (the nearer
            over the farther, each at its depth in the medium) or or (the largest opacity, and of
            each channel the largest light, laid over the medium: overlapping lines do not
            accumulate). Without a slice or plane always over.
        headDesaturation: Desaturation of the heads of lines: 0 none, 1 grey. Comets keep the hue
            of the colour map. Default: 0.7; 0 for plain lines over a dark background in colours
            on which it can hardly be seen, which then have dark tails
            (vector.mark.tailDarkening).
        mark: How lines show their direction and their order in depth. Streamlets (`trace`) have
            no marks.
        color: Colours of lines.
        magnitudeRange: Magnitudes at the ends of the brightness scale, in the unit of the field,
            ascending; lines reach full length at the upper end. Default: the dataset's.
        minMagnitude: Vectors of a smaller magnitude are not drawn; in the unit of the field.
            Default: the dataset's.
        magnitudeIntensity: Dependence of brightness on magnitude: 0 none, 1 black at the lower
            end of magnitudeRange.
        motion: Movement of the texture of lines.
        jitter: Random displacement of kernels and lines that hides the regular grid.
        trace: Streamlets: every line is the part of the streamline through its centre that has
            the length of the straight line, half of it upstream and half downstream, and it is
            not clipped to its kernel (`span`, `jitter.overlap`). With `seeds`: lines through
            them. It ends earlier at a masked cell, at the boundary, where the flow stagnates, and
            after 10000 steps of integration upstream or downstream, which only a very small
            `stepError` or a line of thousands of cells takes; frame reports count these in
            `work.streamlets.ends.steps`. Every sample of the stride is drawn, whatever the
            detail. Not with a slice or plane, and without arrow heads. null: straight lines.
        """
        return self._merged("vector", {"field": field, "space": space, "scale": scale, "length":
            length, "span": span, "stride": stride, "r1": r1, "r2": r2, "opacity": opacity,
            "combine": combine, "headDesaturation": headDesaturation, "mark": mark, "color":
            color, "magnitudeRange": magnitudeRange, "minMagnitude": minMagnitude,
            "magnitudeIntensity": magnitudeIntensity, "motion": motion, "jitter": jitter, "trace":
            trace})

    def scalars(self, *items: ScalarView | str) -> Self:
        """The media, one per scalar field; their extinctions add. An empty array draws none.
        Default: the dataset's. Replaces all; without arguments: none.

        A text is the name of a field: "a" stands for {"field": "a"}.
        """
        return self._listed("scalars", items)

    def depthCue(
        self,
        *,
        strength: float = UNSET,
        near: float = UNSET,
        far: float = UNSET,
    ) -> Self:
        """Darkening of lines with distance from the eye.

        strength: Darkening at `far`: 0 none, 1 black.
        near: Depth at which darkening begins: 0 is the point of the volume nearest to the eye, 1
            the farthest. Less than far.
        far: Depth at which darkening is complete: 0 is the point of the volume nearest to the
            eye, 1 the farthest. Greater than near.
        """
        return self._merged("depthCue", {"strength": strength, "near": near, "far": far})

    def method(
        self,
        *,
        name: Literal["kernel", "slab", "reference"] = UNSET,
        compositing: Literal["simple", "cd-naive", "cd", "analytic", "cd-euler"] = UNSET,
        slabThickness: float = UNSET,
        stopTransmittance: float = UNSET,
        detail: Literal["auto", "full"] = UNSET,
    ) -> Self:
        """Rendering method and its parameters.

        name: kernel: composites kernels one by one in visibility order. slab: divides the volume
            into slabs of constant depth and composites the parts of kernels within each.
            reference: evaluates the rendering integral per pixel, which takes seconds to minutes;
            available on the command line, rejected in requests and streams. With slab, a stream
            may render moving frames by kernel; the frame reports its method.
        compositing: Compositing of a line in a homogeneous piece of medium: simple (line behind
            the whole piece), cd-naive (front part, line and back part in sequence; leaves seams
            around lines), cd (cd-naive corrected, linear in the position of the line), analytic
            (exact), cd-euler (optical depth used as opacity; diverges in dense media). Ignored by
            method reference.
        slabThickness: For method slab: thickness of slabs, in grid cells along the view
            direction.
        stopTransmittance: Early termination: rendering of a pixel block ends when its
            transmittance falls to this value. 0: never.
        detail: auto: axes of which two samples fit in a pixel at the nearest point of the volume
            are halved once by merging samples, but no more lines than one line can represent by
            its opacity; the variant of the frame reports how often. full: every sample is drawn.
            Method reference, curved grids, media with a stride, and lines with a stride without a
            medium always use full. Beside a medium, lines with a stride keep their samples,
            places and lengths at a level no wider than the stride.
        """
        return self._merged("method", {"name": name, "compositing": compositing, "slabThickness":
            slabThickness, "stopTransmittance": stopTransmittance, "detail": detail})

    def quality(
        self,
        *,
        budgetMs: float | None = UNSET,
        maxError: float | None = UNSET,
        lossless: bool = UNSET,
    ) -> Self:
        """Limits within which the server chooses resolution, method and slab thickness.

        budgetMs: Time budget for rendering and encoding a picture or a moving frame, in
            milliseconds; the final frame of a stream has none. The server chooses the setting
            with the least error within the budget, possibly a smaller picture (the frame reports
            its size), without thinner slabs than the view's. Estimated for JPEG; PNG and NPY take
            longer to encode. null: 33 for moving frames of a stream, otherwise no limit.
        maxError: Largest error of a picture before encoding, as linear RMSE. The server chooses
            the fastest setting expected to satisfy it for 95 % of pictures, possibly a smaller
            picture (the frame reports its size). Slabs may be thinner than the view's, or replace
            its method `kernel`, except in moving frames of a stream. budgetMs has precedence. If
            no setting satisfies it, the most accurate one is used, and the frame reports its
            error. null: no limit.
        lossless: Final frames of a stream are encoded as PNG instead of JPEG.
        """
        return self._merged("quality", {"budgetMs": budgetMs, "maxError": maxError, "lossless":
            lossless})

    def annotations(
        self,
        *,
        box: bool = UNSET,
        axes: bool = UNSET,
        north: bool = UNSET,
        scaleBar: bool = UNSET,
        legend: bool = UNSET,
        title: bool = UNSET,
        stepTime: bool = UNSET,
        contourLabels: bool = UNSET,
        size: float = UNSET,
        textColor: str | None = UNSET,
        titleText: str | None = UNSET,
        boxStyle: BoxStyleView = UNSET,
        axesStyle: AxesStyleView = UNSET,
        northStyle: NorthStyleView = UNSET,
        scaleBarStyle: ScaleBarStyleView = UNSET,
        legendStyle: LegendStyleView = UNSET,
        titleStyle: TitleStyleView = UNSET,
        stepTimeStyle: StepTimeStyleView = UNSET,
    ) -> Self:
        """What is drawn and written around the data, in every picture but NPY. Each part is left
        out where it has nothing to tell. They change no measured error.

        box: The edges of the box that contains the data, those at the back behind the data. Not
            on a sphere.
        axes: Ticks along the outline of the box with values in the coordinates of the data, at
            their true places, and the names and units of the axes; with the box, lines on its far
            sides that continue them. Not on a sphere.
        north: An arrow to the north at the centre of the picture, for data with longitudes and
            latitudes.
        scaleBar: A bar of a round length on the ground, across the line of sight at the centre of
            the box.
        legend: The meaning of the colours, the length of the longest line, and the opacity of
            each medium.
        title: The title of the dataset.
        stepTime: The time of the step and its number, counted from 1.
        contourLabels: The values of the contours of surfaces, along the lines. Not where another
            surface or the ground hides them, and not over other texts.
        size: Factor of the size of texts and lines. At 1 a picture of 1280 x 720 has texts of 14
            pixels; smaller ones have smaller texts.
        textColor: sRGB colour of lines and texts. null: one that contrasts with the background.
        titleText: A title of one's own in place of that of the dataset, shown by `title`: one
            line, cut short where it does not fit. Control characters of Unicode and line
            separators are refused, and characters that the font, DejaVu Sans, lacks. null: the
            title of the dataset.
        boxStyle: Size and colour of the edges of the box.
        axesStyle: Size and colour of ticks, their values and the names of axes.
        northStyle: Size and colour of the arrow to the north.
        scaleBarStyle: Size and colour of the scale bar.
        legendStyle: Size and colour of the legend, whose size is limited by the width of the
            picture.
        titleStyle: Size and colour of the title.
        stepTimeStyle: Size and colour of time and step, and what a difference subtracts.
        """
        return self._merged("annotations", {"box": box, "axes": axes, "north": north, "scaleBar":
            scaleBar, "legend": legend, "title": title, "stepTime": stepTime, "contourLabels":
            contourLabels, "size": size, "textColor": textColor, "titleText": titleText,
            "boxStyle": boxStyle, "axesStyle": axesStyle, "northStyle": northStyle,
            "scaleBarStyle": scaleBarStyle, "legendStyle": legendStyle, "titleStyle": titleStyle,
            "stepTimeStyle": stepTimeStyle})

    def region(
        self,
        *,
        x: Sequence[float] | None = UNSET,
        y: Sequence[float] | None = UNSET,
        z: Sequence[float] | None = UNSET,
        longitudes: Sequence[float] | None = UNSET,
        latitudes: Sequence[float] | None = UNSET,
        where: Sequence[FilterView] = UNSET,
        polygon: Mapping[str, Any] | None = UNSET,
    ) -> Self:
        """The part of the data that is drawn: the samples that satisfy every key. Others are
        neither read for the picture nor computed, and box, annotations and the default camera
        follow those that are left. Placement in the world and the jitter of lines stay those of
        the whole grid; but in a region across the seam of an axis of longitudes the columns east
        of it count on, on a flat map beyond the eastern edge, and their lines have another
        jitter.

        x: Range of the x axis (low, high), both ends included, in the coordinates that the
            description of the dataset lists. On an axis of longitudes from west to east, whatever
            turn of the globe they count from: (350, 10) and (-10, 10) are the same. Other axes
            take the ends in either order. null: all.
        y: Range of the y axis. null: all.
        z: Range of the vertical axis; with heightField still that of the axis of the data. null:
            all.
        longitudes: Columns between these longitudes, degrees from west to east, by their own
            positions on grids with 2-D longitudes and latitudes. Requires longitudes and
            latitudes. null: all.
        latitudes: Columns between these latitudes, degrees. null: all.
        where: Filters by other fields at the same step: a sample is treated as masked where one
            of them is beyond its range or masked. Decided for every sample of the data, before a
            level of detail is formed.
        polygon: Columns within a polygon: a GeoJSON geometry (RFC 7946) of type Polygon or
            MultiPolygon, with at most 2000 positions, in longitudes and latitudes, without them
            in x and y. Edges are straight in these coordinates; a longitude is that of any turn
            of the globe. A column is inside by the even-odd rule over the rings of a polygon, so
            that further rings are holes; on an edge it is inside. null: all.
        """
        return self._merged("region", {"x": x, "y": y, "z": z, "longitudes": longitudes,
            "latitudes": latitudes, "where": where, "polygon": polygon})

    def light(
        self,
        *,
        azimuth: float = UNSET,
        elevation: float = UNSET,
        sunAt: SunAtView | None = UNSET,
        ambient: float = UNSET,
        brightness: float = UNSET,
        shadows: float = UNSET,
        anisotropy: float = UNSET,
    ) -> Self:
        """A sun whose light the media scatter once and throw shadows in, also on lines. Lit
        colours are darker than those of the legend. null: none. Slices and planes are drawn
        without it.

        azimuth: Direction of the sun: degrees clockwise from north (+y in the world).
        elevation: Degrees of the sun above the horizon, in the picture: heights are often
            exaggerated. Below 0 there is only ambient light. On a sphere the sun is over the
            latitude `elevation` and the longitude 180 - `azimuth`.
        sunAt: Places the sun where it is at a time and place, instead of azimuth and elevation.
            null: by those. On a sphere the time alone counts.
        ambient: Part of each colour that needs no sun.
        brightness: Of the sun, relative to one that lights a thin medium in the colours of the
            legend. Where it would exceed them, light is cut off.
        shadows: Factor of the extinctions on the way of the sunlight. Media are usually drawn
            thinner than they are, so that one sees into them, and would throw hardly a shadow; 1:
            the same for light and picture.
        anisotropy: Mean cosine of the angle of scattering (phase function of Henyey and
            Greenstein): 0 all directions alike, positive forward, so that clouds before the sun
            shine, negative backward.
        """
        return self._merged("light", {"azimuth": azimuth, "elevation": elevation, "sunAt": sunAt,
            "ambient": ambient, "brightness": brightness, "shadows": shadows, "anisotropy":
            anisotropy})

    def surfaces(self, *items: SurfaceView | str) -> Self:
        """Isosurfaces and sections of scalar fields, each with an opacity, drawn at their depth
        among lines and media. They need at least two samples along every axis, and always show
        every sample. null or an empty array: none. Replaces all; without arguments: none.

        A text is the name of a field: "a" stands for {"field": "a"}.
        """
        return self._listed("surfaces", items)
