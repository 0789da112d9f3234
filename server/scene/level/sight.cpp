#include "server/scene/level/sight.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace windsplat::scene {

namespace {

std::size_t number_of(const Units& units) {
  std::size_t number = 1;
  for (const auto& [first, end] : units) number *= static_cast<std::size_t>(end - first);
  return number;
}

}  // namespace

Sight::Sight(const Camera& camera, const Lattice& level, const Reach& reach,
             const std::array<int, 3>& quantum)
    : camera_(camera), level_(level), reach_(reach), quantum_(quantum) {
  const double pixel = 2 * camera.half_height / camera.height;
  edges_ = {(0.5 * camera.width + reach.pixels) * pixel,
            (0.5 * camera.height + reach.pixels) * pixel};
}

Units Sight::all() const {
  Units out{};
  for (std::size_t a = 0; a < 3; ++a) out[a] = {0, (level_.dims[a] - 1) / quantum_[a] + 1};
  return out;
}

template <class LeftOut, class Add>
void Sight::visit(const Units& units, const LeftOut& is_left_out, const Add& add) const {
  if (is_left_out(units)) return;
  const Seen seen = seen_of(units);
  if (seen == Seen::none) return;
  std::size_t longest = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (units[a][1] - units[a][0] > units[longest][1] - units[longest][0]) longest = a;
  }
  const auto [first, end] = units[longest];
  if (seen == Seen::all || end - first == 1) {
    add(units, seen);
    return;
  }
  Units half = units;
  const int middle = first + (end - first) / 2;
  half[longest] = {first, middle};
  visit(half, is_left_out, add);
  half[longest] = {middle, end};
  visit(half, is_left_out, add);
}

Units Sight::bounds() const {
  const Units every = all();
  Units found{{{every[0][1], 0}, {every[1][1], 0}, {every[2][1], 0}}};
  const auto is_within = [&](const Units& units) {
    for (std::size_t a = 0; a < 3; ++a) {
      if (units[a][0] < found[a][0] || units[a][1] > found[a][1]) return false;
    }
    return true;
  };
  visit(every, is_within, [&](const Units& units, Seen) {
    for (std::size_t a = 0; a < 3; ++a) {
      found[a] = {std::min(found[a][0], units[a][0]), std::max(found[a][1], units[a][1])};
    }
  });
  if (found[0][1] == 0) return {{{0, 1}, {0, 1}, {0, 1}}};
  return found;
}

std::optional<std::vector<Units>> Sight::boxes(std::size_t units_max) const {
  std::vector<Units> found;
  std::size_t count = 0;
  visit(
      all(), [&](const Units&) { return count > units_max; },
      [&](const Units& units, Seen) {
        found.push_back(units);
        count += number_of(units);
      });
  if (count > units_max) return std::nullopt;
  if (found.empty()) found.push_back({{{0, 1}, {0, 1}, {0, 1}}});
  return found;
}

bool Sight::has_within(std::size_t units) const {
  std::size_t count = 0;
  visit(
      all(), [&](const Units&) { return count > units; },
      [&](const Units& found, Seen seen) { count += seen == Seen::all ? number_of(found) : 0; });
  return count > units;
}

Sight::Seen Sight::seen_of(const Units& units) const {
  std::array<std::array<double, 2>, 3> ends{};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto& positions = level_.positions[a];
    const int first = units[a][0] * quantum_[a];
    const int last = std::min(units[a][1] * quantum_[a], level_.dims[a]) - 1;
    const double eye = camera_.eye[static_cast<glm::length_t>(a)];
    ends[a] = {positions[static_cast<std::size_t>(first)] - reach_.world[a] - eye,
               positions[static_cast<std::size_t>(last)] + reach_.world[a] - eye};
  }
  unsigned outside = 31;  // a bit for each plane
  unsigned beyond = 0;    // of those that any corner is outside of
  for (unsigned corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at{ends[0][corner & 1U], ends[1][corner >> 1U & 1U], ends[2][corner >> 2U]};
    const double x = glm::dot(at, camera_.right);
    const double y = glm::dot(at, camera_.up);
    const double depth = glm::dot(at, camera_.forward);
    const double z = camera_.perspective ? depth : 1;
    unsigned here = 0;
    here |= x < -edges_[0] * z ? 1U : 0U;
    here |= x > edges_[0] * z ? 2U : 0U;
    here |= y < -edges_[1] * z ? 4U : 0U;
    here |= y > edges_[1] * z ? 8U : 0U;
    here |= camera_.perspective && depth < camera_.near ? 16U : 0U;
    outside &= here;
    beyond |= here;
  }
  if (outside != 0) return Seen::none;
  return beyond == 0 ? Seen::all : Seen::partly;
}

}  // namespace windsplat::scene
