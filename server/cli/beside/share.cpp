#include "server/cli/beside/share.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "server/data/derived/difference.hpp"
#include "server/scene/surfaces/make_surfaces.hpp"

namespace windsplat::cli {
namespace {

using protocol::Range;

class Sharing {
 public:
  explicit Sharing(const std::array<ComparedView, 2>& views)
      : first_(views[0]), second_(views[1]) {}

  void lines() {
    const protocol::VectorView& a = first_.asked.vector;
    const protocol::VectorView& b = second_.asked.vector;
    protocol::VectorView& one = first_.full.vector;
    protocol::VectorView& other = second_.full.vector;
    const bool named = one.field.kind == protocol::FieldChoice::Kind::named;
    if (!named || one.field != other.field || !is_same(one.field.name)) return;
    adopt(a.length, b.length, one.length, other.length);
    adopt(a.min_magnitude, b.min_magnitude, one.min_magnitude, other.min_magnitude);
    cover(a.magnitude_range, b.magnitude_range, one.magnitude_range, other.magnitude_range);
    if (one.color.by != other.color.by || one.color.field != other.color.field) return;
    const bool by_scalar = one.color.by == protocol::ColorBy::scalar;
    if (by_scalar && !is_same(one.color.field.value())) return;
    cover(a.color.range, b.color.range, one.color.range, other.color.range);
  }

  void media() {
    auto& ones = first_.full.scalars.value();
    auto& others = second_.full.scalars.value();
    for (std::size_t n = 0; n < std::min(ones.size(), others.size()); ++n) {
      protocol::ScalarView& one = ones[n];
      protocol::ScalarView& other = others[n];
      if (one.field != other.field || !is_same(one.field)) continue;
      const protocol::ScalarView a = asked(first_, n);
      const protocol::ScalarView b = asked(second_, n);
      adopt(a.extinction, b.extinction, one.extinction, other.extinction);
      cover(a.color.range, b.color.range, one.color.range, other.color.range);
    }
  }

  void surfaces() {
    auto& ones = first_.full.surfaces;
    auto& others = second_.full.surfaces;
    for (std::size_t n = 0; n < std::min(ones.size(), others.size()); ++n) {
      const std::string field = scene::color_field_of(ones[n]);
      if (field.empty() || field != scene::color_field_of(others[n]) || !is_same(field)) continue;
      cover(first_.asked.surfaces[n].color.range, second_.asked.surfaces[n].color.range,
            ones[n].color.range, others[n].color.range);
    }
  }

 private:
  // Views that do not list media have none of their own.
  static protocol::ScalarView asked(const ComparedView& view, std::size_t n) {
    const auto& scalars = view.asked.scalars;
    return scalars ? (*scalars)[n] : protocol::ScalarView{};
  }

  [[nodiscard]] bool is_same(const std::string& field) const {
    return first_.full.difference.has_value() == second_.full.difference.has_value() &&
           data::derived::check_same_field(field, first_.info, second_.info).has_value();
  }

  template <class Value>
  static void adopt(const std::optional<Value>& a, const std::optional<Value>& b,
                    const std::optional<Value>& one, std::optional<Value>& other) {
    if (!a && !b) other = one;
  }

  static void cover(const std::optional<Range>& a, const std::optional<Range>& b,
                    std::optional<Range>& one, std::optional<Range>& other) {
    if (a || b || !one || !other) return;
    const auto& [low, high] = *one;
    one = Range{std::min(low, (*other)[0]), std::max(high, (*other)[1])};
    other = one;
  }

  ComparedView first_;
  ComparedView second_;
};

}  // namespace

void share_defaults(const std::array<ComparedView, 2>& views) {
  Sharing sharing(views);
  sharing.lines();
  sharing.media();
  sharing.surfaces();
}

}  // namespace windsplat::cli
