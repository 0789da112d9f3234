// windsplat study: writes a report of error against run time of every method, or of extreme cases.
#include "server/study/study.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "server/base/cancel.hpp"
#include "server/base/thread_pool.hpp"
#include "server/cli/command.hpp"
#include "server/cli/data_hosts.hpp"
#include "server/cli/open_store.hpp"
#include "server/cli/progress.hpp"
#include "server/cli/signals.hpp"
#include "server/data/resident/store.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/study/extremes/cases.hpp"
#include "server/study/report/extremes_text.hpp"
#include "server/study/report/report.hpp"

namespace windsplat::cli {
namespace {

// Tolerance of the integral: a hundredth of the least error of a float picture with few layers.
constexpr double truth_tolerance = 1e-7;
constexpr double quick_tolerance = 1e-6;

struct StudyArguments {
  std::string dataset;
  bool standard = false;
  bool extremes = false;
  std::vector<std::string> groups;
  std::vector<std::string> scenes;
  std::string view_file;
  std::string size;
  bool quick = false;
  bool no_reference = false;
  bool no_calibration = false;
  unsigned threads = 0;
  std::string memory = "8G";
  DataHostArguments data_hosts;
  std::string output;
};

// The progress of a study: a line with the time left on a terminal, else one line per scene.
class Reporter {
 public:
  void operator()(const study::Progress& progress) {
    if (line_.is_shown()) {
      line_.show(progress.done, progress.scene + " " + progress.doing);
    } else if (progress.doing == "done") {
      note("study: " + printable(progress.scene) + " done");
    }
  }
  void finish() { line_.clear(); }

 private:
  Progress line_;
};

Result<study::Subject> given_subject(const StudyArguments& arguments, data::Store& store) {
  std::string text = "{}";
  if (!arguments.view_file.empty()) {
    auto file = read_text_file(arguments.view_file, protocol::limits::message_bytes_max);
    if (!file) return file.error();
    text = std::move(*file);
  }
  const auto document = protocol::ViewDocument::parse(text);
  if (!document) return document.error();
  study::PictureSize size = arguments.quick ? study::PictureSize{80, 60} : study::PictureSize{};
  if (!arguments.size.empty()) {
    const auto wanted = parse_extent(arguments.size, 2);
    if (!wanted || (*wanted)[0] > protocol::limits::image_edge_max ||
        (*wanted)[1] > protocol::limits::image_edge_max) {
      return make_error(ErrorKind::malformed, "--size '" + printable(arguments.size) +
                                                  "' is not of the form 160x120, or too large");
    }
    size = {static_cast<int>((*wanted)[0]), static_cast<int>((*wanted)[1])};
  }
  auto dataset = store.add(arguments.dataset);
  if (!dataset) return dataset.error();
  protocol::View view = document->view();
  view.dataset = (*dataset)->info().id;
  return study::make_subject(view.dataset, *dataset, view, size);
}

Result<std::vector<study::Subject>> subjects_of(const StudyArguments& arguments,
                                                data::Store& store) {
  std::vector<study::Subject> subjects;
  if (!arguments.dataset.empty()) {
    if (arguments.standard || !arguments.scenes.empty()) {
      return make_error(ErrorKind::malformed,
                        "DATASET cannot be combined with --standard or --scene");
    }
    auto subject = given_subject(arguments, store);
    if (!subject) return subject.error();
    subjects.push_back(std::move(*subject));
    return subjects;
  }
  if (!arguments.view_file.empty() || !arguments.size.empty()) {
    return make_error(ErrorKind::malformed, "--view and --size need a DATASET");
  }
  const auto names = arguments.scenes.empty() ? study::standard_names() : arguments.scenes;
  for (const std::string& name : names) {
    auto subject = study::standard_subject(name, arguments.quick);
    if (!subject) return subject.error();
    subjects.push_back(std::move(*subject));
  }
  return subjects;
}

study::Truth integral(double tolerance, ThreadPool& pool, const CancelToken& cancel) {
  return [tolerance, &pool, cancel](const scene::Scene& scene) -> Result<study::Picture> {
    engine::reference::Options precision;
    precision.tolerance = tolerance;
    auto picture = engine::reference::render(scene, pool, cancel, precision);
    if (!picture) return picture.error();
    return study::Picture{picture->width, picture->height, std::move(picture->rgba),
                          picture->pieces, picture->evaluations};
  };
}

std::string summary(const study::Report& report, const std::string& folder) {
  std::string text = std::to_string(report.measured) + " points measured";
  text += ", " + std::to_string(report.skipped) + " skipped (measured before), in ";
  text += study::format_number("%.1f", report.seconds) + " s: ";
  text += printable(folder) + "/index.html\n";
  for (const study::SceneReport& scene : report.scenes) {
    if (!scene.calibration) continue;
    const study::Agreement of = study::agreement(*scene.calibration);
    text +=
        printable(scene.name) + ": reported errors are within a factor of 2 of the true ones for ";
    text += study::format_number("%.1f", 100 * of.within_two) + " % of ";
    text += std::to_string(of.count) + " pictures of unseen views\n";
  }
  return text;
}

int interrupted() {
  complain("study: interrupted; run the same command to continue");
  return exit_interrupted;
}

// Exits with 1 if a case fails, so that a test can rely on it.
int extremes_command(const StudyArguments& arguments) {
  const CancelToken cancel;
  const SignalWatch watch([&cancel] { cancel.cancel(); }, nullptr, {exit_interrupted});
  ThreadPool pool(arguments.threads);
  Reporter reporter;
  auto report = study::study_extremes(arguments.groups, arguments.output, pool, cancel,
                                      [&reporter](const std::string& group, double done) {
                                        reporter({group, "", done});
                                      });
  reporter.finish();
  if (!report) {
    if (report.error().kind != ErrorKind::cancelled) return answer(report.error());
    complain("study: interrupted; nothing was written");
    return exit_interrupted;
  }
  const auto written = study::write_report(*report, arguments.output);
  if (!written) return answer(written.error());
  const study::Extremes& extremes = *report->extremes;
  std::string text = study::extremes_text(extremes);
  text += std::to_string(extremes.cases.size()) + " cases, " + std::to_string(extremes.failed());
  text += " failed, in " + study::format_number("%.1f", report->seconds) + " s: ";
  text += printable(arguments.output) + "/index.html\n";
  if (const auto printed = write_stdout(text); !printed) return answer(printed.error());
  return extremes.failed() == 0 ? exit_ok : exit_failed;
}

int study_command(const StudyArguments& arguments) {
  if (arguments.extremes) return extremes_command(arguments);
  const auto limit = memory_limit(arguments.memory);
  if (!limit) return answer(limit.error());
  auto fetcher = open_fetcher(arguments.data_hosts);
  if (!fetcher) return answer(fetcher.error());
  const CancelToken cancel;
  const SignalWatch watch([&cancel] { cancel.cancel(); }, nullptr, {exit_interrupted});
  data::Store store(store_options(*limit, std::move(*fetcher)));
  const auto subjects = subjects_of(arguments, store);
  if (!subjects) return answer(subjects.error());
  ThreadPool pool(arguments.threads);
  study::Options options;
  options.folder = arguments.output;
  options.quick = arguments.quick;
  options.tolerance = arguments.quick ? quick_tolerance : truth_tolerance;
  options.calibrate = !arguments.no_calibration;
  if (!arguments.no_reference) options.truth = integral(options.tolerance, pool, cancel);
  Reporter reporter;
  const auto report =
      study::run_study(*subjects, options, pool, cancel,
                       [&reporter](const study::Progress& progress) { reporter(progress); });
  reporter.finish();
  if (!report) {
    return report.error().kind == ErrorKind::cancelled ? interrupted() : answer(report.error());
  }
  const auto written = study::write_report(*report, arguments.output);
  if (!written) return answer(written.error());
  const auto printed = write_stdout(summary(*report, arguments.output));
  return printed ? exit_ok : answer(printed.error());
}

}  // namespace

void add_study(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand(
      "study", "Measure error against run time of every method; writes a report into a folder");
  const auto arguments = std::make_shared<StudyArguments>();
  CLI::Option* dataset =
      command->add_option("dataset", arguments->dataset, "A sample's name or a file")
          ->type_name("DATASET");
  CLI::Option* standard = command->add_flag("--standard", arguments->standard,
                                            "The standard scenes (without a DATASET)");
  CLI::Option* scene =
      command->add_option("--scene", arguments->scenes, "Only this standard scene; may be repeated")
          ->allow_extra_args(false)
          ->check(CLI::IsMember(study::standard_names()));
  CLI::Option* extremes =
      command
          ->add_flag("--extremes", arguments->extremes,
                     "Stiff and extreme cases instead; fails if one of them does")
          ->excludes(dataset)
          ->excludes(standard)
          ->excludes(scene);
  command
      ->add_option("--group", arguments->groups, "Only this group of --extremes; may be repeated")
      ->needs(extremes)
      ->allow_extra_args(false)
      ->check(CLI::IsMember(study::group_names()));
  command->add_option("--view", arguments->view_file, "A view of DATASET as JSON")
      ->type_name("FILE")
      ->excludes(extremes);
  command->add_option("--size", arguments->size, "Pixels of DATASET's pictures, default 160x120")
      ->type_name("WxH")
      ->excludes(extremes);
  command->add_flag("--quick", arguments->quick, "Small pictures and few points")
      ->excludes(extremes);
  command
      ->add_flag("--no-reference", arguments->no_reference,
                 "Do not integrate: extrapolate the reference from method slab")
      ->excludes(extremes);
  command
      ->add_flag("--no-calibration", arguments->no_calibration,
                 "Do not compare reported errors with measured ones")
      ->excludes(extremes);
  command
      ->add_option("-o,--output", arguments->output,
                   "Folder of the report; existing results are reused")
      ->required()
      ->type_name("DIR");
  add_threads_option(*command, arguments->threads);
  add_memory_option(*command, arguments->memory);
  add_data_host_options(*command, arguments->data_hosts);
  add_verbosity_options(*command);
  command->callback(
      [&chosen, arguments] { chosen = [arguments] { return study_command(*arguments); }; });
}

}  // namespace windsplat::cli
