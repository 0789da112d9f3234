// StudyDocument -> JSON.
#include "protocol/codec_json.hpp"
#include "protocol/study.hpp"

namespace windsplat::protocol {

namespace {

Json point_json(const StudyPoint& point) {
  Json knobs = Json::object();
  for (const auto& [name, value] : point.knobs) knobs[name] = canonical_number(value);
  return Json{{"method", point.method}, {"compositing", point.compositing},
              {"knobs", knobs},         {"rmse", point.rmse},
              {"max", point.max},       {"psnr", point.psnr},
              {"flip", point.flip},     {"ms", point.ms},
              {"msMin", point.ms_min},  {"msMax", point.ms_max},
              {"own", point.own},       {"pareto", point.pareto},
              {"stable", point.stable}};
}

Json calibration_json(const StudyCalibration& calibration) {
  Json agreement = Json::array();
  for (const StudyAgreement& one : calibration.agreement) {
    agreement.push_back(Json{{"of", one.of},
                             {"count", one.count},
                             {"withinTwo", one.within_two},
                             {"median", one.median},
                             {"bounded", one.bounded}});
  }
  Json aims = Json::array();
  for (const StudyAim& one : calibration.aims) {
    aims.push_back(Json{{"maxError", one.max_error},
                        {"frames", one.frames},
                        {"promised", one.promised},
                        {"promisedKept", one.promised_kept},
                        {"possible", one.possible},
                        {"possibleKept", one.possible_kept}});
  }
  Json checks = Json::array();
  for (const StudyCheck& one : calibration.checks) {
    checks.push_back(Json{{"look", one.look}, {"apart", one.apart}, {"estimate", one.estimate}});
  }
  Json points = Json::array();
  for (const StudyCompared& one : calibration.points) {
    points.push_back(Json{{"look", one.look},
                          {"view", one.view},
                          {"settingClass", one.setting_class},
                          {"method", one.method},
                          {"halfLevel", one.half_level},
                          {"coarser", one.coarser},
                          {"thinner", one.thinner},
                          {"error", one.error},
                          {"estimate", one.estimate},
                          {"spread", one.spread},
                          {"prior", one.prior}});
  }
  Json measured = Json::array();
  for (const StudyMeasuredFrame& one : calibration.measured) {
    measured.push_back(Json{{"look", one.look},
                            {"method", one.method},
                            {"error", one.error},
                            {"measured", one.measured}});
  }
  return Json{{"width", calibration.width},        {"height", calibration.height},
              {"surveyed", calibration.surveyed},  {"heldOut", calibration.held_out},
              {"seconds", calibration.seconds},    {"looks", calibration.looks},
              {"agreement", std::move(agreement)}, {"aims", std::move(aims)},
              {"checks", std::move(checks)},       {"points", std::move(points)},
              {"measured", std::move(measured)}};
}

Json scene_json(const StudyScene& scene) {
  Json points = Json::array();
  for (const StudyPoint& point : scene.points) points.push_back(point_json(point));
  Json curves = Json::array();
  for (const StudyCurve& curve : scene.curves) {
    curves.push_back(Json{{"method", curve.method},
                          {"compositing", curve.compositing},
                          {"knob", curve.knob},
                          {"order", curve.order},
                          {"points", curve.points}});
  }
  Json jpeg = Json::array();
  for (const StudyEncoding& encoding : scene.jpeg) {
    jpeg.push_back(Json{{"quality", encoding.quality},
                        {"rmse", encoding.rmse},
                        {"psnr", encoding.psnr},
                        {"flip", encoding.flip},
                        {"bytes", encoding.bytes}});
  }
  const StudyReference& reference = scene.reference;
  Json json{{"name", scene.name},
            {"view", view_to_json(scene.view)},
            {"reference",
             {{"kind", reference.kind},
              {"estimate", reference.estimate},
              {"seconds", reference.seconds},
              {"tolerance", reference.tolerance},
              {"width", reference.width},
              {"height", reference.height},
              {"pieces", reference.pieces},
              {"evaluations", reference.evaluations}}},
            {"points", std::move(points)},
            {"curves", std::move(curves)},
            {"reconstructionRipple", scene.reconstruction_ripple},
            {"jpeg", std::move(jpeg)}};
  if (scene.calibration) json["calibration"] = calibration_json(*scene.calibration);
  for (const StudyPicture& picture : scene.pictures) {
    Json one{{"title", picture.title}, {"png", picture.png}};
    if (!picture.difference_png.empty()) one["differencePng"] = picture.difference_png;
    json["pictures"].push_back(std::move(one));
  }
  return json;
}

Json stability_json(const StudyStability& one) {
  return Json{{"compositing", one.compositing},
              {"tau", one.tau},
              {"error", one.error},
              {"min", one.min},
              {"max", one.max},
              {"bounded", one.bounded},
              {"monotone", one.monotone},
              {"layersMin", one.layers_min},
              {"layersMax", one.layers_max},
              {"diverges", one.diverges}};
}

Json extreme_json(const StudyExtreme& one) {
  Json json{{"group", one.group},     {"label", one.label},           {"value", one.value},
            {"method", one.method},   {"projection", one.projection}, {"mapping", one.mapping},
            {"samples", one.samples}, {"width", one.width},           {"height", one.height},
            {"outcome", one.outcome}};
  if (!one.message.empty()) json["message"] = one.message;
  if (one.truth.empty()) return json;
  json["truth"] = one.truth;
  json["finite"] = one.finite;
  json["bounded"] = one.bounded;
  json["honest"] = one.honest;
  json["monotone"] = one.monotone ? Json(*one.monotone) : Json(nullptr);
  json["rmse"] = one.rmse;
  json["max"] = one.max;
  json["measured"] = one.measured;
  json["estimate"] = one.estimate;
  json["bound"] = one.bound;
  return json;
}

Json extremes_json(const StudyExtremes& extremes) {
  Json cases = Json::array();
  for (const StudyExtreme& one : extremes.cases) cases.push_back(extreme_json(one));
  Json trust = Json::array();
  for (const StudyTrust& one : extremes.trust) {
    Json within = Json::array();
    for (const auto& [limit, values] : one.within) {
      within.push_back(Json{{"limit", limit}, {"values", values}});
    }
    trust.push_back(Json{{"group", one.group},
                         {"parameter", one.parameter},
                         {"method", one.method},
                         {"cases", one.cases},
                         {"refused", one.refused},
                         {"failed", one.failed},
                         {"worst", one.worst},
                         {"worstAt", one.worst_at},
                         {"measured", one.measured},
                         {"leastReported", one.least_reported},
                         {"estimated", one.estimated},
                         {"withinBound", one.within_bound},
                         {"within", std::move(within)}});
  }
  return Json{{"cases", std::move(cases)}, {"trust", std::move(trust)}};
}

}  // namespace

std::string encode_study(const StudyDocument& study, bool compact) {
  Json scenes = Json::array();
  for (const StudyScene& scene : study.scenes) scenes.push_back(scene_json(scene));
  Json stability = Json::array();
  for (const StudyStability& one : study.stability) stability.push_back(stability_json(one));
  Json document{{"machine",
                 {{"processor", study.processor},
                  {"system", study.system},
                  {"compiler", study.compiler},
                  {"windsplat", study.version},
                  {"kernels", study.kernels},
                  {"hardwareThreads", study.hardware_threads},
                  {"threads", study.threads}}},
                {"quick", study.quick},
                {"seconds", study.seconds},
                {"runs", study.runs},
                {"measured", study.measured},
                {"skipped", study.skipped},
                {"scenes", std::move(scenes)},
                {"stability", std::move(stability)},
                {"stabilityLayers", study.stability_layers}};
  if (study.extremes) document["extremes"] = extremes_json(*study.extremes);
  return document.dump(compact ? -1 : 2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace windsplat::protocol
