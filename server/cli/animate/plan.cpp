#include "server/cli/animate/plan.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "protocol/camera_path.hpp"
#include "protocol/limits.hpp"
#include "server/base/whole_file.hpp"
#include "server/cli/command.hpp"

namespace windsplat::cli {
namespace {

constexpr std::size_t digits_max = 9;

// Steps that every panel which shows them has.
int steps_of(const std::vector<Panel>& panels) {
  std::size_t least = panels.front().dataset->info().steps.size();
  for (const Panel& panel : panels) {
    if (!panel.keeps_step) least = std::min(least, panel.dataset->info().steps.size());
  }
  return static_cast<int>(least);
}

Result<protocol::CameraPath> read_path(const std::string& name) {
  const auto text = read_text_file(name, protocol::limits::message_bytes_max);
  if (!text) return text.error();
  auto document = protocol::parse_camera_path(*text);
  if (document) return document;
  Error error = document.error();
  error.message = "--path " + in_quotes(name) + ": " + error.message;
  return error;
}

Result<protocol::AnimationMotion> motion_of(const AnimateArguments& arguments) {
  protocol::AnimationMotion motion;
  if (!arguments.steps.empty()) {
    const auto steps = parse_steps(arguments.steps);
    if (!steps) {
      return make_error(ErrorKind::malformed, "--steps '" + printable(arguments.steps) +
                                                  "' is not of the form 0:239 or 0:239:2");
    }
    motion.steps = *steps;
  }
  motion.frames = arguments.frames;
  motion.per_step = arguments.per_step;
  motion.fps = arguments.fps;
  motion.turn = arguments.turn;
  if (!arguments.path.empty()) {
    auto path = read_path(arguments.path);
    if (!path) return path.error();
    motion.path = std::move(*path);
  }
  return motion;
}

// Options in place of the pointers of a posted animation.
Error named_by_option(Error error) {
  constexpr std::array<std::array<const char*, 2>, 4> names{{{"/steps", "--steps"},
                                                             {"/frames", "--frames"},
                                                             {"/perStep", "--per-step"},
                                                             {"/path", "--path"}}};
  for (const auto& [pointer, option] : names) {
    if (error.at.empty() || error.at.front().pointer != pointer) continue;
    error.message = option + (": " + error.at.front().detail);
  }
  return error;
}

}  // namespace

std::optional<protocol::StepRange> parse_steps(std::string_view text) {
  protocol::StepRange steps{0, 0, 1};
  const char* at = text.data();
  const char* const end = at + text.size();
  int parts = 0;
  for (int* number : {&steps.first, &*steps.last, &steps.stride}) {
    if (parts > 0) {
      if (at == end) break;
      if (*at++ != ':') return std::nullopt;
    }
    const auto [next, fault] = std::from_chars(at, end, *number);
    if (fault != std::errc()) return std::nullopt;
    at = next;
    ++parts;
  }
  const bool ordered = steps.first >= 0 && *steps.last >= steps.first && steps.stride >= 1;
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

Result<Plan> plan_of(const AnimateArguments& arguments, Target target,
                     const std::vector<Panel>& panels) {
  auto asked = motion_of(arguments);
  if (!asked) return asked.error();
  const Panel& first = panels.front();
  auto motion =
      movie::Motion::of(std::move(*asked), first.view, first.dataset->info(), steps_of(panels));
  if (!motion) return named_by_option(motion.error());
  if (arguments.fps && !target.container && !motion->is_by_time()) {
    return make_error(ErrorKind::invalid,
                      "--fps: has no effect on numbered pictures, unless the camera follows a "
                      "--path in seconds");
  }
  for (const Panel& panel : panels) {
    if (!target.container) break;
    if (auto fits = movie::check_size_is_fixed(panel.view); !fits) return fits.error();
  }
  return Plan{std::move(target), std::move(*motion)};
}

}  // namespace windsplat::cli
