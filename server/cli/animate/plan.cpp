#include "server/cli/animate/plan.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "protocol/camera_path.hpp"
#include "protocol/limits.hpp"
#include "server/base/whole_file.hpp"
#include "server/cli/command.hpp"

namespace windsplat::cli {
namespace {

constexpr std::size_t digits_max = 9;
constexpr int frames_of_a_turn = 120;  // of one step, without --frames

bool draws_lines(const protocol::View& view, const data::DatasetInfo& info) {
  using Kind = protocol::FieldChoice::Kind;
  const Kind kind = view.vector.field.kind;
  if (kind != Kind::dataset_default) return kind == Kind::named;
  return info.first(data::FieldKind::vector) != nullptr;
}

// Steps that every panel which shows them has.
int steps_of(const std::vector<Panel>& panels) {
  std::size_t least = panels.front().dataset->info().steps.size();
  for (const Panel& panel : panels) {
    if (!panel.keeps_step) least = std::min(least, panel.dataset->info().steps.size());
  }
  return static_cast<int>(least);
}

Result<Steps> chosen_steps(const AnimateArguments& arguments, const std::vector<Panel>& panels) {
  const int step_count = steps_of(panels);
  Steps steps;
  steps.last = step_count - 1;
  if (!arguments.steps.empty()) {
    const auto chosen = parse_steps(arguments.steps);
    if (!chosen) {
      return make_error(ErrorKind::malformed, "--steps '" + printable(arguments.steps) +
                                                  "' is not of the form 0:239 or 0:239:2");
    }
    steps = *chosen;
  }
  if (steps.last < step_count) return steps;
  return make_error(ErrorKind::invalid,
                    "--steps: the dataset's last step" +
                        std::string(panels.size() > 1 ? " that both have is " : " is ") +
                        std::to_string(step_count - 1));
}

Result<movie::CameraPath> read_path(const std::string& name) {
  const auto text = read_text_file(name, protocol::limits::message_bytes_max);
  if (!text) return text.error();
  auto document = protocol::parse_camera_path(*text);
  auto path = document ? movie::CameraPath::of(std::move(*document))
                       : Result<movie::CameraPath>(document.error());
  if (path) return path;
  Error error = path.error();
  error.message = "--path " + in_quotes(name) + ": " + error.message;
  return error;
}

// Options that exclude each other, or have no effect.
Result<void> check_motion(const AnimateArguments& arguments, const Plan& plan,
                          const std::vector<Panel>& panels) {
  const protocol::View& view = panels.front().view;
  const bool by_time = plan.path && plan.path->unit() == protocol::CameraPath::Unit::seconds;
  if (arguments.fps && !plan.target.container && !by_time) {
    return make_error(ErrorKind::invalid,
                      "--fps: has no effect on numbered pictures, unless the camera follows a "
                      "--path in seconds");
  }
  const bool moves = view.vector.motion == protocol::MotionMode::phase &&
                     draws_lines(view, panels.front().dataset->info());
  if (plan.turn || plan.path || moves || plan.frames <= plan.steps.count()) return {};
  const bool many = arguments.frames.has_value();
  return make_error(ErrorKind::invalid,
                    (many ? "--frames: more pictures than steps would repeat them"
                          : std::string("--per-step: has no effect")) +
                        " unless the view has lines and /vector/motion/mode=phase, or the camera "
                        "moves (--turn, --path)");
}

// How many pictures: those asked for, or those of the path, or of the steps.
Result<int> frames_of(const AnimateArguments& arguments, const Plan& plan) {
  if (arguments.frames) return *arguments.frames;
  const int steps = plan.steps.count();
  double count = static_cast<double>(steps) * arguments.per_step.value_or(1);
  if (!arguments.per_step) {
    if (plan.path && plan.path->unit() == protocol::CameraPath::Unit::seconds) {
      constexpr double rounding = 1e-9;
      count = std::floor(plan.path->last() * plan.fps + rounding) + 1;
    } else if (plan.turn && steps == 1) {
      count = frames_of_a_turn;
    }
  }
  if (count <= frames_max) return static_cast<int>(count);
  return make_error(ErrorKind::invalid,
                    "an animation has at most " + std::to_string(frames_max) + " pictures");
}

}  // namespace

std::optional<Steps> parse_steps(std::string_view text) {
  Steps steps;
  const char* at = text.data();
  const char* const end = at + text.size();
  int parts = 0;
  for (int* number : {&steps.first, &steps.last, &steps.stride}) {
    if (parts > 0) {
      if (at == end) break;
      if (*at++ != ':') return std::nullopt;
    }
    const auto [next, fault] = std::from_chars(at, end, *number);
    if (fault != std::errc()) return std::nullopt;
    at = next;
    ++parts;
  }
  const bool ordered = steps.first >= 0 && steps.last >= steps.first && steps.stride >= 1;
  if (at != end || parts < 2 || !ordered) return std::nullopt;
  return steps;
}

std::string Pattern::name(int number) const {
  const std::string text = std::to_string(number);
  std::string out = before;
  if (text.size() < digits) out.append(digits - text.size(), '0');
  return out.append(text).append(after);
}

std::optional<Pattern> parse_pattern(std::string_view text) {
  Pattern pattern;
  bool numbered = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string& part = numbered ? pattern.after : pattern.before;
    if (text[i] != '%') {
      part += text[i];
      continue;
    }
    if (text.substr(i + 1, 1) == "%") {
      part += text[++i];
      continue;
    }
    const std::size_t end = text.find_first_not_of("0123456789", i + 1);
    if (numbered || end == std::string_view::npos || text[end] != 'd') return std::nullopt;
    const std::string_view width = text.substr(i + 1, end - i - 1);
    if (!width.empty()) {
      const auto [next, fault] =
          std::from_chars(width.data(), width.data() + width.size(), pattern.digits);
      const bool in_range = pattern.digits >= 1 && pattern.digits <= digits_max;
      if (width[0] != '0' || fault != std::errc() || !in_range) return std::nullopt;
    }
    numbered = true;
    i = end;
  }
  if (!numbered) return std::nullopt;
  return pattern;
}

Result<Target> target_of(const AnimateArguments& arguments) {
  Target target;
  const std::string& name = arguments.output;
  target.container = movie::container_of(name);
  const auto invalid = [&](const std::string& what) {
    return make_error(ErrorKind::invalid, "-o '" + printable(name) + "'" + what);
  };
  if (!arguments.format.empty()) {
    const auto format = movie::container_of("." + arguments.format);
    if (target.container ? format != target.container : !is_stdout(name) && !is_stream(name)) {
      return invalid(": its name tells the format; --format is for - and pipes");
    }
    target.container = format;
    return target;
  }
  target.pattern = parse_pattern(name);
  if (target.container) {
    if (target.pattern) return invalid(": a movie is one file, whose name has no number");
    return target;
  }
  if (is_stdout(name) || is_stream(name)) return invalid(" needs --format mp4, webm or zip");
  if (!target.pattern) {
    return invalid(
        " is neither a movie (.mp4, .webm or .zip) nor a pattern of pictures with exactly one "
        "number, like f_%04d.jpg");
  }
  const auto format = format_of(target.pattern->name(0));
  if (!format) return format.error();
  target.format = *format;
  return target;
}

Moment Plan::moment(int frame) const {
  const std::int64_t at = static_cast<std::int64_t>(frame) * steps.count();
  const std::int64_t index = at / frames;
  return {steps.first + static_cast<int>(index) * steps.stride,
          static_cast<double>(at % frames) / frames};
}

Result<protocol::CameraView> Plan::camera(int frame, const scene::Turn& base) const {
  if (turn) return movie::turned(base.camera, *turn * frame / frames, base.centre);
  if (!path) return base.camera;
  if (path->unit() == protocol::CameraPath::Unit::seconds) return path->at(frame / fps);
  const Moment now = moment(frame);
  return path->at(now.step + steps.stride * now.part);
}

Result<Plan> plan_of(const AnimateArguments& arguments, Target target,
                     const std::vector<Panel>& panels) {
  Plan plan;
  plan.target = std::move(target);
  const auto steps = chosen_steps(arguments, panels);
  if (!steps) return steps.error();
  plan.steps = *steps;
  plan.fps = arguments.fps.value_or(plan.fps);
  plan.turn = arguments.turn;
  if (!arguments.path.empty()) {
    auto path = read_path(arguments.path);
    if (!path) return path.error();
    plan.path = std::move(*path);
  }
  const auto frames = frames_of(arguments, plan);
  if (!frames) return frames.error();
  plan.frames = *frames;
  if (auto valid = check_motion(arguments, plan, panels); !valid) return valid.error();
  for (int n = 0; plan.path && n < plan.frames; ++n) {  // before an hour of drawing
    if (const auto camera = plan.camera(n, {}); !camera) return camera.error();
  }
  for (const Panel& panel : panels) {
    const protocol::QualityView& limits = panel.view.quality;
    if (plan.target.container && (limits.budget_ms || limits.max_error)) {
      return make_error_at(ErrorKind::invalid, "/quality",
                           "limits on time or error may change the size of a picture, and those of "
                           "a movie have one size: set budgetMs and maxError to null");
    }
  }
  return plan;
}

}  // namespace windsplat::cli
