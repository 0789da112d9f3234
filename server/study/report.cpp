// Report -> study.json, study.csv, and all files into their folder.
#include "server/study/report.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "protocol/study.hpp"
#include "server/base/whole_file.hpp"

namespace windsplat::study {

namespace {

constexpr std::array<Knob, 5> knobs{Knob::stride, Knob::span, Knob::slab_thickness,
                                    Knob::stop_transmittance, Knob::width};

// A knob that the point's method or scene does not have is not told.
bool has_knob(const SceneReport& scene, const Setting& setting, Knob knob) {
  if (knob == Knob::slab_thickness) return setting.method == scene::Method::slab;
  if (knob == Knob::span) {
    return scene.view.vector.field.kind == protocol::FieldChoice::Kind::named;
  }
  return true;
}

protocol::StudyAgreement document_of(const Agreement& of, std::string name) {
  return {std::move(name), of.count, of.within_two, of.median, of.bounded};
}

protocol::StudyCalibration document_of(const Calibration& calibration) {
  protocol::StudyCalibration out;
  out.width = calibration.plan.width;
  out.height = calibration.plan.height;
  out.surveyed = calibration.plan.surveyed;
  out.held_out = calibration.plan.held_out;
  out.seconds = calibration.seconds;
  out.looks = calibration.looks;
  const auto add = [&](const Agreement& of, std::string name) {
    if (of.count > 0) out.agreement.push_back(document_of(of, std::move(name)));
  };
  add(agreement(calibration), "estimated");
  for (const SettingClass kind : setting_classes) {
    add(agreement(calibration,
                  [kind](const Compared& one) {
                    return class_of(quality::settings[one.setting]) == kind;
                  }),
        name_of(kind));
  }
  for (std::size_t look = 0; look < calibration.looks.size(); ++look) {
    add(agreement(calibration, [look](const Compared& one) { return one.look == look; }),
        calibration.looks[look]);
  }
  add(agreement_of_priors(calibration), "prior");
  add(agreement_of_measured(calibration), "measured");
  add(agreement_of_encodings(calibration), "jpeg");
  for (const Aimed& aimed : calibration.aimed) {
    out.aims.push_back({aimed.max_error, aimed.frames, aimed.promised, aimed.promised_kept,
                        aimed.possible, aimed.possible_kept});
  }
  for (const TruthCheck& check : calibration.checks) {
    out.checks.push_back({calibration.looks[check.look], check.apart, check.estimate});
  }
  for (const Compared& one : calibration.compared) {
    const quality::Setting& setting = quality::settings[one.setting];
    const bool slab = setting.method == protocol::MethodName::slab;
    out.points.push_back({calibration.looks[one.look], one.view, slab ? "slab" : "kernel",
                          setting.half_level, setting.coarser, setting.thinner, one.error,
                          one.forecast.error, one.forecast.spread, one.prior.error});
  }
  return out;
}

protocol::StudyScene document_of(const SceneReport& scene) {
  protocol::StudyScene out;
  out.name = scene.name;
  out.view = scene.view;
  out.reference = {scene.integral ? "integral" : "extrapolated",
                   scene.truth_estimate,
                   scene.truth_seconds,
                   scene.integral ? scene.tolerance : std::numeric_limits<double>::quiet_NaN(),
                   scene.width,
                   scene.height,
                   scene.pieces,
                   scene.evaluations};
  for (const Point& point : scene.points) {
    protocol::StudyPoint to;
    to.method = name_of(point.setting.method);
    to.compositing = name_of(point.setting.compositing);
    for (const Knob knob : knobs) {
      if (!has_knob(scene, point.setting, knob)) continue;
      to.knobs.emplace_back(name_of(knob), value_of(point.setting.knobs, knob));
    }
    const Measurement& m = point.measured;
    to.rmse = m.rmse;
    to.max = m.max;
    to.psnr = m.psnr;
    to.flip = m.flip;
    to.ms = m.ms;
    to.ms_min = m.ms_min;
    to.ms_max = m.ms_max;
    to.pareto = point.pareto;
    to.stable = m.stable;
    out.points.push_back(std::move(to));
  }
  for (const Curve& curve : scene.curves) {
    out.curves.push_back({name_of(curve.method), name_of(curve.compositing), name_of(curve.knob),
                          curve.order, curve.points});
  }
  out.reconstruction_ripple = scene.reconstruction_ripple;
  for (const Encoded& e : scene.encoded) {
    out.jpeg.push_back({e.quality, e.rmse, e.psnr, e.flip, e.bytes});
  }
  if (scene.calibration) out.calibration = document_of(*scene.calibration);
  return out;
}

}  // namespace

std::string report_json(const Report& report) {
  protocol::StudyDocument document;
  const Machine& machine = report.machine;
  document.processor = machine.processor;
  document.system = machine.system;
  document.compiler = machine.compiler;
  document.version = machine.version;
  document.kernels = machine.kernels;
  document.hardware_threads = machine.hardware_threads;
  document.threads = machine.threads;
  document.quick = report.quick;
  document.seconds = report.seconds;
  document.runs = report.runs;
  document.measured = report.measured;
  document.skipped = report.skipped;
  for (const SceneReport& scene : report.scenes) document.scenes.push_back(document_of(scene));
  for (const Stiffness& s : report.stability) {
    document.stability.push_back({name_of(s.compositing), s.tau, s.error, s.min, s.max, s.bounded,
                                  s.monotone, s.layers_min, s.layers_max, s.diverges});
  }
  return protocol::encode_study(document);
}

std::string report_csv(const Report& report) {
  std::string text =
      "scene,method,compositing,stride,span,slabThickness,stopTransmittance,width,"
      "rmse,max,psnr,flip,ms,msMin,msMax,pareto,stable\n";
  for (const SceneReport& scene : report.scenes) {
    for (const Point& point : scene.points) {
      // A name with a comma or a quote in it is quoted (RFC 4180).
      std::string name = scene.name;
      if (name.find_first_of(",\"") != std::string::npos) {
        std::string quoted(1, '"');
        for (const char c : name) quoted.append(c == '"' ? 2 : 1, c);
        name = quoted + '"';
      }
      text += name;
      text += ',';
      text += name_of(point.setting.method);
      text += ',';
      text += name_of(point.setting.compositing);
      for (const Knob knob : knobs) {
        text += ',';
        if (has_knob(scene, point.setting, knob)) {
          text += format_number("%.6g", value_of(point.setting.knobs, knob));
        }
      }
      const Measurement& m = point.measured;
      for (const double v : {m.rmse, m.max, m.psnr, m.flip, m.ms, m.ms_min, m.ms_max}) {
        text += ',';
        if (std::isfinite(v)) text += format_number("%.6g", v);
      }
      text += point.pareto ? ",1" : ",0";
      text += m.stable ? ",1\n" : ",0\n";
    }
  }
  return text;
}

Result<void> write_report(const Report& report, const std::filesystem::path& folder) {
  const auto page = report_page(report);
  if (!page) return page.error();
  for (const SceneReport& scene : report.scenes) {
    std::string name;
    for (const char c : scene.name) name += c == '/' || c == '\0' ? '_' : c;
    name += ".svg";
    if (auto done = write_whole_file(folder / ("plot-" + name), plot_svg(scene)); !done) {
      return done;
    }
    if (!scene.calibration) continue;
    const auto path = folder / ("calibration-" + name);
    if (auto done = write_whole_file(path, calibration_svg(scene)); !done) return done;
  }
  if (auto done = write_whole_file(folder / "study.csv", report_csv(report)); !done) return done;
  if (auto done = write_whole_file(folder / "study.json", report_json(report)); !done) return done;
  return write_whole_file(folder / "index.html", *page);
}

std::string format_number(const char* format, double value) {
  if (std::isnan(value)) return "-";
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

}  // namespace windsplat::study
