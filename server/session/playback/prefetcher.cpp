#include "server/session/playback/prefetcher.hpp"

#include <utility>

#include "server/quality/pick.hpp"

namespace windsplat::session {
namespace {

// The data of the view, apart from its step.
std::string fields_of(const protocol::View& view) {
  std::string names = view.dataset;
  const auto add = [&](const std::string& name) {
    names += '\n';
    names += name;
  };
  if (const auto& minus = view.difference) {
    add(minus->dataset.value_or("") + '@' + (minus->step ? std::to_string(*minus->step) : ""));
  }
  add(std::to_string(static_cast<int>(view.vector.field.kind)) + view.vector.field.name);
  add(view.vector.color.field.value_or(""));
  if (!view.scalars) add("default");
  for (const auto& scalar : view.scalars.value_or(std::vector<protocol::ScalarView>{})) {
    add(scalar.field);
  }
  return names;
}

}  // namespace

std::vector<int> Prefetcher::wanted_steps(const Situation& now, const Check& check) const {
  constexpr int ahead_max = 16;
  const protocol::View& view = now.view;
  if (!now.may_load || view.dataset.empty()) return {};
  if (now.player.running()) return now.player.upcoming(ahead_max);
  const bool same = requested_.view.dataset == view.dataset && requested_.view.step == view.step &&
                    requested_fields_ == fields_of(view);
  if (!now.final_shown) return same && requested_at_rest_ ? requested_.steps : std::vector<int>{};
  const auto count = check(view);
  std::vector<int> steps;
  if (count && view.step + 1 < *count) steps.push_back(view.step + 1);
  if (count && view.step > 0) steps.push_back(view.step - 1);
  return steps;
}

std::optional<Prefetch> Prefetcher::update(const Situation& now, const Check& check) {
  std::vector<int> steps = wanted_steps(now, check);
  std::string fields = fields_of(now.view);
  const bool none = steps.empty() && requested_.steps.empty();
  requested_at_rest_ = !now.player.running();
  // Steps of playback are drawn at the setting of the previous one.
  const quality::Setting setting = now.player.running() && !steps.empty()
                                       ? now.moving_setting
                                       : quality::settings[quality::own_setting(now.view)];
  const bool same = steps == requested_.steps && fields == requested_fields_;
  if (none || (same && (steps.empty() || setting == requested_.setting))) return std::nullopt;
  requested_ = {steps.empty() ? protocol::View{} : now.view, std::move(steps), setting};
  requested_fields_ = std::move(fields);
  return requested_;
}

}  // namespace windsplat::session
