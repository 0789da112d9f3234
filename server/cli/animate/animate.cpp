// windsplat animate: draws the pictures of an animation, as numbered files or as a movie.
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/elapsed.hpp"
#include "server/base/thread_pool.hpp"
#include "server/base/whole_file.hpp"
#include "server/cli/animate/frame_sink.hpp"
#include "server/cli/animate/plan.hpp"
#include "server/cli/beside/panels.hpp"
#include "server/cli/beside/sheets.hpp"
#include "server/cli/command.hpp"
#include "server/cli/picture.hpp"
#include "server/cli/progress.hpp"
#include "server/cli/signals.hpp"

namespace windsplat::cli {
namespace {

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
  int coarser = 0;            // pictures from a coarser level of the data than would suffice
  std::string first_coarser;  // which, of the first of them
};

Result<Reports> draw_all(const Plan& plan, std::vector<Panel>& panels, Sheets& sheets,
                         FrameSink& sink, const CancelToken& cancel) {
  Reports reports;
  const movie::Motion& motion = plan.motion;
  const int frames = motion.frames();
  // Both of a pair have one camera.
  const Panel& first = panels.front();
  const auto base = motion.base(first.view, first.asked, [&first](const protocol::View& view) {
    return frame::complete(view, *first.dataset, true);
  });
  if (!base) return base.error();
  std::vector<protocol::View> views;
  views.reserve(panels.size());
  for (const Panel& panel : panels) views.push_back(panel.view);
  Progress progress;
  const std::string of_all = " of " + std::to_string(frames) + " pictures";
  for (int n = 0; n < frames; ++n) {
    const auto show = [&](double part, std::string_view) {
      progress.show((n + part) / frames, std::to_string(n) + of_all);
    };
    show(0, {});
    for (std::size_t p = 0; p < panels.size(); ++p) {
      auto view = motion.view_of(n, views[p], *base, panels[p].keeps_step);
      if (!view) return view.error();
      panels[p].view = std::move(*view);
    }
    const auto sheet = sheets.draw(cancel, show);
    if (cancel.cancelled()) return interrupted(n, frames);
    if (!sheet) return sheet.error();
    if (auto done = sink.add(n, *sheet); !done) {
      return cancel.cancelled() ? interrupted(n, frames) : done.error();
    }
    if (!sheet->exceeded.empty()) ++reports.exceeding;
    if (!sheet->empty.empty() && reports.empty++ == 0) reports.first_empty = sheet->empty;
    if (!sheet->empty_surfaces.empty() && reports.lacking++ == 0) {
      reports.first_lacking = sheet->empty_surfaces;
    }
    if (!sheet->coarser.empty() && reports.coarser++ == 0) reports.first_coarser = sheet->coarser;
    reports.lines += sheet->reports;
  }
  progress.show(1, "writing");
  if (auto done = sink.finish(); !done) {
    return cancel.cancelled() ? interrupted(frames, frames) : done.error();
  }
  return reports;
}

void note_remarks(const Reports& reports) {
  if (reports.exceeding > 0) {
    note(std::to_string(reports.exceeding) + " pictures exceed a limit of /quality");
  }
  if (reports.empty > 0) {
    note(std::to_string(reports.empty) +
         " pictures show nothing of the data; the first: " + reports.first_empty);
  }
  if (reports.lacking > 0) {
    note("a surface is empty in " + std::to_string(reports.lacking) +
         " pictures; in the first: " + reports.first_lacking);
  }
  if (reports.coarser > 0) {
    note(std::to_string(reports.coarser) + " pictures lack detail; of the first " +
         reports.first_coarser);
  }
}

Result<void> animate(const AnimateArguments& arguments, const CancelToken& cancel) {
  auto target = target_of(arguments);
  if (!target) return target.error();
  if (auto free = check_streams({{"--view", arguments.view.view_file}, {"--path", arguments.path}},
                                {{"-o", arguments.output}, {"--report", arguments.report}});
      !free) {
    return free.error();
  }
  auto panels = open_panels(arguments.view);
  if (!panels) return panels.error();
  const auto plan = plan_of(arguments, std::move(*target), *panels);
  if (!plan) return plan.error();
  auto sink = FrameSink::of(*plan, arguments.output, cancel);
  if (!sink) return sink.error();

  frame::Encoding encoding = sink->encoding(arguments.view);
  encoding.measure = !arguments.report.empty();
  encoding.measure_change = encoding.measure;
  ThreadPool pool(arguments.threads);
  auto sheets = Sheets::of(*panels, encoding, pool);
  if (!sheets) return sheets.error();
  const auto start = std::chrono::steady_clock::now();
  const auto reports = draw_all(*plan, *panels, *sheets, *sink, cancel);
  if (!reports) return reports.error();
  detail(std::to_string(plan->motion.frames()) + " pictures in " +
         seconds_text(seconds_since(start)) + " to " + in_quotes(arguments.output));
  note_remarks(*reports);
  if (arguments.report.empty()) return {};
  const std::string& lines = reports->lines;
  return write_output(arguments.report,
                      {reinterpret_cast<const std::uint8_t*>(lines.data()), lines.size()});
}

// What a second Ctrl-C leaves behind otherwise.
void remove_part_of(const std::string& output) {
  if (!is_stdout(output) && movie::container_of(output)) {
    ::unlink(part_of(end_of_links(output)).c_str());
  }
}

}  // namespace

void add_animate(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("animate", "Draw a movie, or a numbered picture for each time step");
  const auto arguments = std::make_shared<AnimateArguments>();
  add_view_options(*command, arguments->view);
  command
      ->add_option("-o,--output", arguments->output,
                   "out.mp4, .webm, .zip (pictures as PNG); or pictures f_%04d.jpg, .png, .npy, "
                   ".pdf or .svg, which count from 0; - writes to stdout")
      ->required()
      ->type_name("FILE");
  command->add_option("--format", arguments->format, "Kind of movie that is written to - or a pipe")
      ->check(CLI::IsMember({"mp4", "webm", "zip"}));
  command
      ->add_option("--steps", arguments->steps, "First and last step, and a stride; default: all")
      ->type_name("A:B[:S]");
  CLI::Option* frames =
      command
          ->add_option("--frames", arguments->frames,
                       "Pictures in all, spread evenly over the steps; default: one for each step, "
                       "those of a --path in seconds, or 120 for a --turn of one step")
          ->check(CLI::Range(1, protocol::motion_frames_max))
          ->type_name("N");
  command
      ->add_option("--per-step", arguments->per_step,
                   "Pictures for each step, for phase motion or a moving camera; default: 1")
      ->check(CLI::Range(1, protocol::frames_per_step_max))
      ->excludes(frames)
      ->type_name("N");
  command->add_option("--fps", arguments->fps, "Pictures a second of a movie; default: 24")
      ->check(between(protocol::animation_fps_min, protocol::animation_fps_max))
      ->type_name("N");
  CLI::Option* turn =
      command
          ->add_option("--turn", arguments->turn,
                       "Turn the camera evenly about the vertical axis through its target by these "
                       "degrees, eastward; 360 repeats without a jump")
          ->check(between(-protocol::turn_max, protocol::turn_max))
          ->type_name("DEGREES");
  command
      ->add_option("--path", arguments->path,
                   "Move the camera smoothly through the keyframes of a JSON file")
      ->excludes(turn)
      ->type_name("FILE");
  command
      ->add_option("--report", arguments->report,
                   "Write the report of each picture as a line of JSON; - writes to stdout")
      ->type_name("FILE");
  add_threads_option(*command, arguments->threads);
  command->callback([&chosen, arguments] {
    chosen = [arguments] {
      const CancelToken cancel;
      const SignalWatch watch([&cancel] { cancel.cancel(); }, nullptr,
                              {exit_interrupted, [&] { remove_part_of(arguments->output); }});
      const auto done = animate(*arguments, cancel);
      if (done) return exit_ok;
      const int code = answer(done.error());
      return done.error().kind == ErrorKind::cancelled ? exit_interrupted : code;
    };
  });
}

}  // namespace windsplat::cli
