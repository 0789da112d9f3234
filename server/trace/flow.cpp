// Interpolation of a field and of the positions of its samples.
#include "server/trace/flow.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>

namespace windsplat::trace {

namespace {

// The samples on both sides of a place along each axis, and the share of the second.
struct Corners {
  std::array<std::array<int, 2>, 3> sample{};
  std::array<double, 3> part{};  // continues beyond [0, 1] in the outer half of outermost cells
};

Corners corners_of(const Flow& flow, const glm::dvec3& index) {
  Corners out;
  for (int a = 0; a < 3; ++a) {
    const int count = flow.dims[a];
    if (a == 0 && flow.around > 0) {
      const double low = std::floor(index[a]);
      const double turns = std::floor(low / flow.around);
      const int first = std::clamp(static_cast<int>(low - turns * flow.around), 0, flow.around - 1);
      out.sample[a] = {first, (first + 1) % flow.around};
      out.part[a] = index[a] - low;
      continue;
    }
    const double last = std::max(count - 2, 0);
    const int first = static_cast<int>(std::clamp(std::floor(index[a]), 0.0, last));
    out.sample[a] = {first, std::min(first + 1, count - 1)};
    out.part[a] = index[a] - first;
  }
  return out;
}

std::size_t number_of(const Flow& flow, int x, int y, int z) {
  const auto row = static_cast<std::size_t>(z) * static_cast<std::size_t>(flow.dims[1]) +
                   static_cast<std::size_t>(y);
  return row * static_cast<std::size_t>(flow.dims[0]) + static_cast<std::size_t>(x);
}

// Calls visit(number of the sample, corner) for the eight corners.
template <class Visit>
void each_corner(const Flow& flow, const Corners& at, const Visit& visit) {
  for (unsigned corner = 0; corner < 8; ++corner) {
    visit(number_of(flow, at.sample[0][corner & 1U], at.sample[1][corner >> 1U & 1U],
                    at.sample[2][corner >> 2U]),
          corner);
  }
}

double share_of(unsigned bit, double part) { return bit != 0 ? part : 1 - part; }

glm::dvec3 place_of(const Flow& flow, std::size_t sample) {
  const std::array<float, 3>& p = flow.places[sample];
  return {p[0], p[1], p[2]};
}

// Edges of the cell at a place: the derivative of the position by each index. Along an axis of one
// sample the edge has the width of the cell and is perpendicular to the others.
struct Cell {
  glm::dvec3 place{0, 0, 0};
  std::array<glm::dvec3, 3> edge{};
};

void raise_edges(const Flow& flow, const glm::dvec3& index, Cell& cell) {
  for (int a = 0; a < 3; ++a) {
    if (flow.dims[a] > 1) continue;
    const int b = (a + 1) % 3;
    const int c = (a + 2) % 3;
    glm::dvec3 normal(0);
    normal[a] = 1;
    if (flow.dims[b] > 1 && flow.dims[c] > 1) normal = glm::cross(cell.edge[b], cell.edge[c]);
    const double size = glm::length(normal);
    if (size > 0) cell.edge[a] = normal * (flow.spacing[a][0] / size);
    cell.place += index[a] * cell.edge[a];
  }
}

Cell curved_cell(const Flow& flow, const glm::dvec3& index, const Corners& at) {
  Cell cell;
  each_corner(flow, at, [&](std::size_t sample, unsigned corner) {
    std::array<double, 3> share{};
    std::array<double, 3> slope{};
    for (unsigned a = 0; a < 3; ++a) {
      const bool single = flow.dims[a] == 1;
      const unsigned bit = corner >> a & 1U;
      share[a] = single ? share_of(bit, 0) : share_of(bit, at.part[a]);
      slope[a] = single ? 0 : bit != 0 ? 1 : -1;
    }
    const glm::dvec3 place = place_of(flow, sample);
    cell.place += share[0] * share[1] * share[2] * place;
    cell.edge[0] += slope[0] * share[1] * share[2] * place;
    cell.edge[1] += share[0] * slope[1] * share[2] * place;
    cell.edge[2] += share[0] * share[1] * slope[2] * place;
  });
  raise_edges(flow, index, cell);
  return cell;
}

// Along an axis that closes: in the outer halves of the outermost cells positions go on linearly.
void place_around(const Flow& flow, double index, Cell& cell) {
  const double at = index - flow.around * std::floor((index + 0.5) / flow.around);
  const int last = flow.around - 1;
  const int low = std::clamp(static_cast<int>(std::floor(at)), 0, last);
  const auto& positions = flow.positions[0];
  const auto k = static_cast<std::size_t>(low);
  const bool inner = at >= 0 && at < last;
  const double width = inner ? positions[k + 1] - positions[k] : flow.spacing[0][k];
  cell.place.x = positions[k] + (at - low) * width;
  cell.edge[0].x = width;
}

Cell straight_cell(const Flow& flow, const glm::dvec3& index, const Corners& at) {
  Cell cell;
  for (int a = 0; a < 3; ++a) {
    if (a == 0 && flow.around > 0) {
      place_around(flow, index.x, cell);
      continue;
    }
    const auto [low, high] = at.sample[a];
    const double from = flow.positions[a][static_cast<std::size_t>(low)];
    const double width =
        high > low ? flow.positions[a][static_cast<std::size_t>(high)] - from : flow.spacing[a][0];
    cell.place[a] = from + at.part[a] * width;
    cell.edge[a][a] = width;
  }
  return cell;
}

Cell cell_at(const Flow& flow, const glm::dvec3& index, const Corners& at) {
  return flow.places != nullptr ? curved_cell(flow, index, at) : straight_cell(flow, index, at);
}

// Linear between the samples on both sides, constant beyond the outermost.
double rate_at(std::span<const double> rates, const std::array<int, 2>& sample, double part) {
  const double share = std::clamp(part, 0.0, 1.0);
  return (1 - share) * rates[static_cast<std::size_t>(sample[0])] +
         share * rates[static_cast<std::size_t>(sample[1])];
}

// The means of some values at a place, without masked samples. False where every sample with a
// share is masked.
bool interpolate(const Flow& flow, const Corners& at, const std::array<const float*, 3>& values,
                 glm::dvec3& out) {
  double total = 0;
  out = glm::dvec3(0);
  each_corner(flow, at, [&](std::size_t sample, unsigned corner) {
    double share = 1;
    for (unsigned a = 0; a < 3; ++a) {
      share *= share_of(corner >> a & 1U, std::clamp(at.part[a], 0.0, 1.0));
    }
    if (!(share > 0) || std::isnan(values[0][sample])) return;
    total += share;
    for (int c = 0; c < 3; ++c) {
      const float* const from = values[static_cast<std::size_t>(c)];
      if (from != nullptr) out[c] += share * static_cast<double>(from[sample]);
    }
  });
  if (!(total > 0)) return false;
  out /= total;
  return true;
}

// The frames on both sides of a time, and the share of the second; the same twice if one counts.
struct Moment {
  std::array<const std::array<const float*, 3>*, 2> of{};
  double part = 0;
};

Moment moment_of(const Flow& flow, double time) {
  const std::span<const Frame> frames = flow.frames;
  if (frames.empty()) return {{&flow.components, &flow.components}, 0};
  const auto after = std::upper_bound(frames.begin(), frames.end(), time,
                                      [](double t, const Frame& frame) { return t < frame.time; });
  if (after == frames.begin()) return {{&after->components, &after->components}, 0};
  const auto before = after - 1;
  if (after == frames.end()) return {{&before->components, &before->components}, 0};
  const double part = (time - before->time) / (after->time - before->time);
  if (!(part > 0)) return {{&before->components, &before->components}, 0};
  return {{&before->components, &after->components}, part};
}

bool vector_at(const Flow& flow, const Corners& at, double time, glm::dvec3& out) {
  const Moment moment = moment_of(flow, time);
  if (!interpolate(flow, at, *moment.of[0], out)) return false;
  if (!(moment.part > 0)) return true;
  glm::dvec3 after(0);
  if (!interpolate(flow, at, *moment.of[1], after)) return false;
  out = (1 - moment.part) * out + moment.part * after;
  return true;
}

}  // namespace

bool Flow::bounds(const glm::dvec3& index) const {
  for (int a = 0; a < 3; ++a) {
    if (a == 0 && around > 0) continue;
    if (!(index[a] >= -0.5 && index[a] <= dims[a] - 0.5)) return false;
  }
  return true;
}

bool Flow::holds(const glm::dvec3& index, double time) const {
  if (!bounds(index)) return false;
  std::array<int, 3> nearest{};
  const Corners at = corners_of(*this, index);
  for (int a = 0; a < 3; ++a) nearest[a] = at.sample[a][at.part[a] >= 0.5 ? 1 : 0];
  const std::size_t number = number_of(*this, nearest[0], nearest[1], nearest[2]);
  const Moment moment = moment_of(*this, time);
  return !std::isnan((*moment.of[0])[0][number]) && !std::isnan((*moment.of[1])[0][number]);
}

std::uint32_t Flow::nearest(const glm::dvec3& index) const {
  std::uint32_t number = 0;
  for (std::size_t a = 3; a-- > 0;) {
    const int count = dims[a];
    int at = static_cast<int>(std::lround(index[static_cast<glm::length_t>(a)]));
    if (a == 0 && around > 0) at = (at % around + around) % around;
    number = number * static_cast<std::uint32_t>(count) +
             static_cast<std::uint32_t>(std::clamp(at, 0, count - 1));
  }
  return number;
}

glm::dvec3 Flow::place(const glm::dvec3& index) const {
  return cell_at(*this, index, corners_of(*this, index)).place;
}

int Flow::turn(const glm::dvec3& index) const {
  if (around <= 0 || places != nullptr) return 0;
  return static_cast<int>(std::floor((index.x + 0.5) / around));
}

glm::dvec3 Flow::within_turn(const glm::dvec3& index, int turn) const {
  if (around <= 0 || places != nullptr) return index;
  constexpr double inside = 1e-9;
  const double first = static_cast<double>(turn) * around - 0.5;
  return {std::clamp(index.x, first, first + around - inside), index.y, index.z};
}

double Flow::cell_volume(const glm::dvec3& index) const {
  const Cell cell = cell_at(*this, index, corners_of(*this, index));
  return std::abs(glm::dot(cell.edge[0], glm::cross(cell.edge[1], cell.edge[2])));
}

bool motion_at(const Flow& flow, const glm::dvec3& index, Motion& out, double time) {
  constexpr double flattest = 1e-6;  // of an edge, relative to the longest
  const Corners at = corners_of(flow, index);
  if (!vector_at(flow, at, time, out.vector)) return false;
  out.magnitude = glm::length(out.vector);
  glm::dvec3 drawn = out.vector * flow.scale;
  if (!flow.rate_x.empty()) {
    drawn *= glm::dvec3(rate_at(flow.rate_x, at.sample[1], at.part[1]), flow.rate_y,
                        rate_at(flow.rate_z, at.sample[2], at.part[2]));
  }
  out.speed = glm::length(drawn);
  out.along = out.drawn = glm::dvec3(0);
  if (!(out.speed > 0)) return true;
  drawn /= out.speed;
  out.drawn = drawn;
  const Cell cell = cell_at(flow, index, at);
  glm::dvec3 width(0);
  for (int a = 0; a < 3; ++a) width[a] = glm::length(cell.edge[a]);
  const double longest = std::max({width.x, width.y, width.z});
  glm::dvec3 world(0);
  for (int a = 0; a < 3; ++a) {
    if (!(width[a] > flattest * longest)) return false;
    world += drawn[a] / width[a] * cell.edge[a];
  }
  const double length = glm::length(world);
  if (!(length > 0)) return false;
  out.along = drawn / (width * length);
  return true;
}

double value_at(const Flow& flow, const float* values, const glm::dvec3& index) {
  glm::dvec3 out(0);
  const bool known = interpolate(flow, corners_of(flow, index), {values, nullptr, nullptr}, out);
  return known ? out.x : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace windsplat::trace
