// windsplat animate: draws a numbered picture for each frame.
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/elapsed.hpp"
#include "server/base/thread_pool.hpp"
#include "server/cli/beside/panels.hpp"
#include "server/cli/beside/sheets.hpp"
#include "server/cli/command.hpp"
#include "server/cli/picture.hpp"
#include "server/cli/signals.hpp"
#include "server/engine/render.hpp"

namespace windsplat::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int per_step_max = 1000;
constexpr std::size_t digits_max = 9;

struct AnimateArguments {
  ViewArguments view;
  std::string steps;
  std::string output;
  std::string report;  // empty: no report
  int per_step = 1;
  unsigned threads = 0;
};

struct Steps {
  int first = 0;
  int last = 0;
  int stride = 1;
  [[nodiscard]] int count() const { return (last - first) / stride + 1; }
};

// "A:B" or "A:B:S".
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

// A file name pattern with a zero-padded number.
struct Pattern {
  std::string before;
  std::string after;
  std::size_t digits = 0;

  [[nodiscard]] std::string name(int number) const {
    const std::string text = std::to_string(number);
    std::string out = before;
    if (text.size() < digits) out.append(digits - text.size(), '0');
    return out.append(text).append(after);
  }
};

// Exactly one %d or %04d or the like; %% is a percent sign.
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

// A progress line on stderr, overwritten if stderr is a terminal; coloured unless NO_COLOR is set.
class Progress {
 public:
  explicit Progress(int total) : total_(total) {
    const char* no_color = std::getenv("NO_COLOR");
    colored_ = no_color == nullptr || *no_color == '\0';
  }
  ~Progress() {
    if (shown_) std::fputc('\n', stderr);
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(int done) {
    if (!terminal_) return;
    constexpr int cells = 30;
    const int full = static_cast<int>(std::int64_t{cells} * done / total_);
    const double spent = seconds_since(start_);
    std::string line(1, '\r');
    if (colored_) line += "\x1b[32m";
    line.append(static_cast<std::size_t>(full), '#');
    if (colored_) line += "\x1b[0m";
    line.append(static_cast<std::size_t>(cells - full), '.');
    line.append(" ").append(std::to_string(done)).append("/").append(std::to_string(total_));
    if (done > 0) {
      const auto left = std::llround(spent / done * (total_ - done));
      line.append(", ").append(std::to_string(left)).append(" s left    ");
    }
    std::fwrite(line.data(), 1, line.size(), stderr);
    shown_ = true;
  }

 private:
  int total_;
  bool terminal_ = isatty(STDERR_FILENO) == 1;
  bool colored_ = false;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now();
};

// The validated job.
struct Plan {
  Steps steps;
  Pattern pattern;
  frame::Format format = frame::Format::jpeg;
  int per_step = 1;
};

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

Result<Plan> plan_of(const AnimateArguments& arguments, const std::vector<Panel>& panels) {
  const data::DatasetInfo& info = panels.front().dataset->info();
  const protocol::View& view = panels.front().view;
  const int step_count = steps_of(panels);
  Plan plan;
  const auto pattern = parse_pattern(arguments.output);
  if (!pattern) {
    return make_error(ErrorKind::invalid,
                      "-o '" + printable(arguments.output) +
                          "' needs exactly one number, like f_%04d.jpg: animate writes pictures, "
                          "of which ffmpeg makes a video");
  }
  plan.pattern = *pattern;
  const auto format = format_of(plan.pattern.name(0));
  if (!format) return format.error();
  plan.format = *format;
  plan.steps.last = step_count - 1;
  if (!arguments.steps.empty()) {
    const auto steps = parse_steps(arguments.steps);
    if (!steps) {
      return make_error(ErrorKind::malformed, "--steps '" + printable(arguments.steps) +
                                                  "' is not of the form 0:239 or 0:239:2");
    }
    plan.steps = *steps;
  }
  if (plan.steps.last >= step_count) {
    return make_error(ErrorKind::invalid,
                      "--steps: the dataset's last step" +
                          std::string(panels.size() > 1 ? " that both have is " : " is ") +
                          std::to_string(step_count - 1));
  }
  plan.per_step = arguments.per_step;
  const bool moves = view.vector.motion == protocol::MotionMode::phase && draws_lines(view, info);
  if (plan.per_step > 1 && !moves) {
    return make_error(ErrorKind::invalid,
                      "--per-step: has no effect unless the view has lines and "
                      "/vector/motion/mode=phase");
  }
  if (plan.steps.count() > std::numeric_limits<int>::max() / plan.per_step) {
    return make_error(ErrorKind::invalid, "--per-step: too many frames");
  }
  return plan;
}

Error interrupted(int done, int total) {
  return make_error(ErrorKind::cancelled, "animate: interrupted after " + std::to_string(done) +
                                              " of " + std::to_string(total) + " frames");
}

// Reports of the pictures, a line each, and how many of them exceed a limit of the view or are
// empty.
struct Reports {
  std::string lines;
  int exceeding = 0;
  int empty = 0;              // pictures that show nothing of the data
  std::string first_empty;    // why the first of them does
  int lacking = 0;            // pictures that show something, but not all surfaces
  std::string first_lacking;  // why the first of them does not
};

Result<Reports> draw_all(const Plan& plan, std::vector<Panel>& panels, Sheets& sheets,
                         const CancelToken& cancel) {
  Reports reports;
  const int total = plan.steps.count() * plan.per_step;
  std::vector<double> starts;  // of the motion
  starts.reserve(panels.size());
  for (const Panel& panel : panels) starts.push_back(panel.view.vector.motion_time);
  Progress progress(total);
  for (int n = 0; n < total; ++n) {
    progress.show(n);
    // Fraction of the way to the next drawn step, so that the phase is continuous.
    const double part = static_cast<double>(n % plan.per_step) / plan.per_step;
    for (std::size_t p = 0; p < panels.size(); ++p) {
      protocol::View& view = panels[p].view;
      if (!panels[p].keeps_step) {
        view.step = plan.steps.first + n / plan.per_step * plan.steps.stride;
      }
      view.vector.motion_time = starts[p] + plan.steps.stride * part;
    }
    const auto sheet = sheets.draw(cancel);
    if (cancel.cancelled()) return interrupted(n, total);
    if (!sheet) return sheet.error();
    if (auto done = write_output(plan.pattern.name(n), sheet->bytes); !done) return done.error();
    if (!sheet->exceeded.empty()) ++reports.exceeding;
    if (!sheet->empty.empty() && reports.empty++ == 0) reports.first_empty = sheet->empty;
    if (!sheet->empty_surfaces.empty() && reports.lacking++ == 0) {
      reports.first_lacking = sheet->empty_surfaces;
    }
    reports.lines += sheet->reports;
  }
  progress.show(total);
  return reports;
}

Result<void> animate(const AnimateArguments& arguments, const CancelToken& cancel) {
  auto panels = open_panels(arguments.view);
  if (!panels) return panels.error();
  const auto plan = plan_of(arguments, *panels);
  if (!plan) return plan.error();

  frame::Encoding encoding = file_encoding(plan->format, arguments.view);
  encoding.measure = !arguments.report.empty();
  encoding.measure_change = encoding.measure;
  ThreadPool pool(arguments.threads);
  auto sheets = Sheets::of(*panels, encoding, pool);
  if (!sheets) return sheets.error();
  const auto reports = draw_all(*plan, *panels, *sheets, cancel);
  if (!reports) return reports.error();
  if (reports->exceeding > 0) {
    complain(std::to_string(reports->exceeding) + " pictures exceed a limit of /quality");
  }
  if (reports->empty > 0) {
    complain(std::to_string(reports->empty) +
             " pictures show nothing of the data; the first: " + reports->first_empty);
  }
  if (reports->lacking > 0) {
    complain("a surface is empty in " + std::to_string(reports->lacking) +
             " pictures; in the first: " + reports->first_lacking);
  }
  if (arguments.report.empty()) return {};
  const std::string& lines = reports->lines;
  return write_output(arguments.report,
                      {reinterpret_cast<const std::uint8_t*>(lines.data()), lines.size()});
}

}  // namespace

void add_animate(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("animate", "Draw a picture for each time step");
  const auto arguments = std::make_shared<AnimateArguments>();
  add_view_options(*command, arguments->view);
  command
      ->add_option("--steps", arguments->steps, "First and last step, and a stride; default: all")
      ->type_name("A:B[:S]");
  command->add_option("--per-step", arguments->per_step, "Frames per step, for phase motion")
      ->check(CLI::Range(1, per_step_max))
      ->type_name("N")
      ->capture_default_str();
  command->add_option("-o", arguments->output, "f_%04d.jpg, .png or .npy; frames count from 0")
      ->required()
      ->type_name("PATTERN");
  command
      ->add_option("--report", arguments->report,
                   "Write the report of each picture as a line of JSON; - writes to stdout")
      ->type_name("FILE");
  add_threads_option(*command, arguments->threads);
  command->callback([&chosen, arguments] {
    chosen = [arguments] {
      const CancelToken cancel;
      const SignalWatch watch([&cancel] { cancel.cancel(); }, nullptr, {exit_interrupted});
      const auto done = animate(*arguments, cancel);
      if (done) return exit_ok;
      const int code = answer(done.error());
      return done.error().kind == ErrorKind::cancelled ? exit_interrupted : code;
    };
  });
}

}  // namespace windsplat::cli
