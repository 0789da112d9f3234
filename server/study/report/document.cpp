// Report -> the typed values of study.schema.json; pictures -> base64 PNG.
#include "server/study/report/document.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "server/image/encode.hpp"
#include "server/study/extremes/cases.hpp"

namespace windsplat::study {

namespace {

std::string base64(const image::Bytes& bytes) {
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8U | (k < count ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? digits[word >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

// The kernel method has no slab thickness.
bool is_own(const SceneReport& scene, const Setting& setting) {
  const Knobs own = own_knobs(scene.view);
  Knobs knobs = setting.knobs;
  if (setting.method == scene::Method::kernel) knobs.slab_thickness = own.slab_thickness;
  return knobs == own;
}

const char* method_name(protocol::MethodName method) {
  return method == protocol::MethodName::slab ? "slab" : "kernel";
}

protocol::StudyAgreement document_of(const Agreement& of, std::string name) {
  return {std::move(name), of.count, of.within_two, of.median, of.bounded};
}

protocol::StudyCalibration document_of(const Calibration& calibration) {
  protocol::StudyCalibration out;
  out.width = calibration.plan.width;
  out.height = calibration.plan.height;
  out.surveyed = calibration.plan.calibrated;
  out.held_out = calibration.plan.held_out;
  out.seconds = calibration.seconds;
  out.looks = calibration.variants;
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
  for (std::size_t variant = 0; variant < calibration.variants.size(); ++variant) {
    add(agreement(calibration, [variant](const Compared& one) { return one.variant == variant; }),
        calibration.variants[variant]);
  }
  add(agreement_of_priors(calibration), "prior");
  add(agreement_of_measured(calibration), "measured");
  add(agreement_of_encodings(calibration), "jpeg");
  for (const Aimed& aimed : calibration.aimed) {
    out.aims.push_back({aimed.max_error, aimed.frames, aimed.promised, aimed.promised_kept,
                        aimed.possible, aimed.possible_kept});
  }
  for (const TruthCheck& check : calibration.checks) {
    out.checks.push_back({calibration.variants[check.variant], check.apart, check.estimate});
  }
  for (const Compared& one : calibration.compared) {
    const quality::Setting& setting = quality::settings[one.setting];
    out.points.push_back({calibration.variants[one.variant], one.view, name_of(class_of(setting)),
                          method_name(setting.method), setting.half_level, setting.coarser,
                          setting.thinner, one.error, one.forecast.error, one.forecast.spread,
                          one.prior.error});
  }
  for (const MeasuredFrame& one : calibration.measured) {
    out.measured.push_back(
        {calibration.variants[one.variant], one.slab ? "slab" : "kernel", one.error, one.measured});
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
    for (const Knob knob : report_knobs) {
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
    to.own = is_own(scene, point.setting);
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

protocol::StudyExtreme document_of(const CaseResult& one) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  protocol::StudyExtreme out;
  out.group = one.group;
  out.label = one.label;
  out.value = one.value;
  out.method = one.method;
  out.projection = one.projection;
  out.mapping = one.mapping;
  out.samples = one.samples;
  out.width = one.width;
  out.height = one.height;
  out.outcome = outcome_of(one);
  out.message = one.message;
  if (one.message.empty()) out.truth = name_of(one.truth);
  out.finite = one.verdict.finite;
  out.bounded = one.verdict.bounded;
  out.honest = one.verdict.honest;
  out.monotone = one.verdict.monotone;
  out.rmse = one.verdict.rmse;
  out.max = one.verdict.max;
  out.measured = one.measured.value_or(unknown);
  out.estimate = one.estimate;
  out.bound = one.bound;
  return out;
}

protocol::StudyExtremes document_of(const Extremes& extremes) {
  protocol::StudyExtremes out;
  for (const CaseResult& one : extremes.cases) out.cases.push_back(document_of(one));
  for (const Trust& trust : extremes.trust) {
    protocol::StudyTrust to;
    to.group = trust.group;
    to.parameter = parameter_of(trust.group);
    to.method = trust.method;
    to.cases = trust.cases;
    to.refused = trust.refused;
    to.failed = trust.failed;
    to.worst = trust.worst;
    to.worst_at = trust.worst_at;
    to.measured = trust.measured;
    to.least_reported = trust.least_reported;
    to.estimated = trust.estimated;
    to.within_bound = trust.within_bound;
    for (std::size_t i = 0; i < trust_limits.size(); ++i) {
      to.within.emplace_back(trust_limits.at(i), trust.within.at(i));
    }
    out.trust.push_back(std::move(to));
  }
  return out;
}

}  // namespace

bool has_knob(const SceneReport& scene, const Setting& setting, Knob knob) {
  if (knob == Knob::slab_thickness) return setting.method == scene::Method::slab;
  if (knob == Knob::span) {
    return scene.view.vector.field.kind == protocol::FieldChoice::Kind::named;
  }
  return true;
}

protocol::StudyDocument document_of(const Report& report) {
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
  document.stability_layers = stiff_layers;
  if (report.extremes) document.extremes = document_of(*report.extremes);
  return document;
}

Result<std::vector<protocol::StudyPicture>> encoded_pictures(const SceneReport& scene) {
  std::vector<protocol::StudyPicture> pictures;
  for (const Shown& shown : scene.pictures) {
    const auto png = image::encode_png(shown.rgb, scene.width, scene.height);
    if (!png) return png.error();
    protocol::StudyPicture picture{shown.title, base64(*png), {}};
    if (!shown.difference_rgb.empty()) {
      const auto difference = image::encode_png(shown.difference_rgb, scene.width, scene.height);
      if (!difference) return difference.error();
      picture.difference_png = base64(*difference);
    }
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

}  // namespace windsplat::study
