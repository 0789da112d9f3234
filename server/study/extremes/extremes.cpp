// Groups -> cases -> pictures of every method and their truth -> verdicts.
#include "server/study/extremes/extremes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <string_view>
#include <utility>

#include "protocol/codec.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/frame/frame.hpp"
#include "server/frame/measure.hpp"
#include "server/quality/pick.hpp"
#include "server/quality/tables.hpp"
#include "server/study/extremes/cases.hpp"
#include "server/study/scenes.hpp"
#include "server/study/truth/integrator.hpp"

namespace windsplat::study {

namespace {

using protocol::MethodName;
using protocol::Projection;

constexpr std::array<MethodName, 3> methods{MethodName::kernel, MethodName::slab,
                                            MethodName::reference};
constexpr int truth_steps = 12;
constexpr double reference_tolerance = 1e-7;
constexpr std::size_t compared_max = 433;    // pixels; prime, so that they fall into all columns
constexpr std::size_t reference_max = 6000;  // pixels: the reference takes milliseconds for each

const char* text_of(MethodName method) {
  switch (method) {
    case MethodName::kernel:
      return "kernel";
    case MethodName::slab:
      return "slab";
    case MethodName::reference:
      return "reference";
  }
  return "";
}

const char* text_of(protocol::GeometryView const& geometry) {
  if (geometry.height_field) return "terrain";
  if (geometry.slice) return "slice";
  switch (geometry.mapping) {
    case protocol::GeometryMapping::flat:
      return "flat";
    case protocol::GeometryMapping::curvilinear:
      return "curvilinear";
    case protocol::GeometryMapping::sphere:
      return "sphere";
  }
  return "";
}

struct TrueLight {
  std::string key;  // what it is the truth of
  TruthKind kind = TruthKind::integrator;
  std::vector<std::size_t> pixels;
  std::vector<double> rgba;
};

// At most compared_max pixels, spread over the picture.
std::vector<std::size_t> spread(std::size_t pixels) {
  const std::size_t count = std::min(pixels, compared_max);
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back((2 * i + 1) * pixels / (2 * count));
  return out;
}

bool is_integrable(const scene::Scene& scene) {
  const auto& dims = scene.lattice.dims;
  const bool layer = std::any_of(dims.begin(), dims.end(), [](int n) { return n < 2; });
  return !scene.body && !(scene.lattice.places && layer);
}

void integrate(const scene::Scene& scene, ThreadPool& pool, TrueLight& out) {
  constexpr std::size_t chunk = 12;
  const auto width = static_cast<std::size_t>(scene.camera.width);
  std::vector<truth::Pixel> pixels;
  for (const std::size_t at : out.pixels) {
    pixels.push_back({static_cast<int>(at % width), static_cast<int>(at / width)});
  }
  out.rgba.resize(4 * pixels.size());
  pool.run((pixels.size() + chunk - 1) / chunk, [&](std::size_t n, unsigned) {
    const std::size_t first = n * chunk;
    const std::size_t count = std::min(chunk, pixels.size() - first);
    const auto lights =
        truth::integrate(scene, std::span(pixels).subspan(first, count), truth_steps);
    for (std::size_t i = 0; i < count; ++i) {
      double* to = out.rgba.data() + 4 * (first + i);
      std::copy(lights[i].rgb.begin(), lights[i].rgb.end(), to);
      to[3] = lights[i].alpha;
    }
  });
}

class Battery {
 public:
  Battery(ThreadPool& pool, const CancelToken& cancel) : pool_(pool), cancel_(cancel) {}

  Result<void> run(const Group& group) {
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
      before_.clear();
      truth_ = {};
      for (const Case& one : group.cases(projection)) {
        if (auto done = run(group, one); !done) return done;
      }
    }
    return {};
  }

  Extremes results() { return {std::move(cases_), {}}; }

 private:
  Result<void> run(const Group& group, const Case& one) {
    const auto subject = checked(one);
    for (const MethodName method : methods) {
      if (cancel_.cancelled()) return make_error(ErrorKind::cancelled, "the study was interrupted");
      if (std::string_view(group.name) == "slabs" && method != MethodName::slab) continue;
      const auto pixels = static_cast<std::size_t>(one.view.image.width) * one.view.image.height;
      if (method == MethodName::reference && pixels > reference_max) continue;
      CaseResult result;
      result.group = group.name;
      result.label = one.label;
      result.value = one.value;
      result.method = text_of(method);
      result.projection =
          one.view.camera.projection == Projection::perspective ? "perspective" : "orthographic";
      result.mapping = text_of(one.view.geometry);
      result.samples = one.dataset->info().grid.dims();
      result.width = one.view.image.width;
      result.height = one.view.image.height;
      auto drawn =
          subject ? draw(group, one, *subject, method, result) : Result<void>(subject.error());
      if (!drawn && drawn.error().kind == ErrorKind::cancelled) return drawn;
      judge_refusal(one.refused_by_design, drawn, result);
      cases_.push_back(std::move(result));
    }
    return {};
  }

  // The view as a request would give it: within the limits of the schema, and framed.
  static Result<Subject> checked(const Case& one) {
    const auto document = protocol::ViewDocument::parse(protocol::encode_view(one.view));
    if (!document) return document.error();
    const protocol::View view = document->view();
    return make_subject("extremes", one.dataset, view, {view.image.width, view.image.height});
  }

  Result<void> draw(const Group& group, const Case& one, const Subject& subject, MethodName method,
                    CaseResult& result) {
    protocol::View view = subject.view;
    view.method.name = method;
    const auto completed = frame::complete(view, *one.dataset, true);
    if (!completed) return completed.error();
    frame::Encoding encoding;
    encoding.format = frame::Format::npy;
    encoding.allow_reference = true;
    encoding.measure = true;
    const auto prepared =
        frame::prepare(*completed, frame::own_setting(*completed), *one.dataset, encoding);
    if (!prepared) return prepared.error();
    frame::Workspace workspace;
    std::vector<float>& rgba = workspace.space.image().rgba;
    if (method == MethodName::reference) {
      const auto picture = reference(prepared->scene);
      if (!picture) return picture.error();
      rgba.assign(picture->begin(), picture->end());
    } else {
      auto drawn = frame::draw(*prepared, *one.dataset, pool_, cancel_, workspace);
      if (!drawn) return drawn;
    }
    if (auto known = find_truth(one, prepared->scene, result); !known) return known;
    if (method != MethodName::reference) {
      report_error(*prepared, *one.dataset, workspace.drawn, result);
    }
    Observed observed{rgba, truth_.pixels, truth_.rgba, result.measured};
    if (!result.measured && !std::isnan(result.bound)) observed.reported = result.bound;
    // The reference is no truth of itself.
    const bool itself = method == MethodName::reference && truth_.kind == TruthKind::reference;
    if (itself) observed.truth = {};
    result.verdict = judge(observed);
    if (group.monotone) check_monotone(rgba, subject.view.method.stop_transmittance, result);
    return {};
  }

  // The errors that the frame reports: the measured one, and the estimate in its absence.
  static void report_error(const frame::Prepared& prepared, const data::Dataset& dataset,
                           const frame::Frame& drawn, CaseResult& result) {
    result.measured = drawn.error;
    const auto forecast = quality::Tables().forecast(
        quality::signature_of(prepared.completed.view()), prepared.setting,
        frame::viewpoint_of(prepared.completed, dataset));
    result.estimate = forecast.error;
    result.bound = quality::error_bound(forecast);
  }

  void check_monotone(const std::vector<float>& rgba, double stop, CaseResult& result) {
    std::vector<float>& before = before_[result.method];
    result.verdict.monotone =
        before.size() != rgba.size() || is_monotone(before, rgba, stop + rounding);
    before = rgba;
  }

  Result<std::vector<double>> reference(const scene::Scene& scene) {
    engine::reference::Options options;
    options.tolerance = reference_tolerance;
    auto picture = engine::reference::render(scene, pool_, cancel_, options);
    if (!picture) return picture.error();
    return std::move(picture->rgba);
  }

  // The truth does not depend on the method: it is found once for all of them.
  Result<void> find_truth(const Case& one, const scene::Scene& scene, CaseResult& result) {
    protocol::View view = one.view;
    view.method = {};
    std::string key = std::to_string(reinterpret_cast<std::uintptr_t>(one.dataset.get()));
    key += protocol::encode_view(view);
    if (key != truth_.key) {
      TrueLight light;
      const auto pixels = static_cast<std::size_t>(scene.camera.width) * scene.camera.height;
      light.pixels = spread(pixels);
      if (one.invisible) {
        light.kind = TruthKind::closed_form;
        light.rgba.assign(4 * light.pixels.size(), 0);
      } else if (is_integrable(scene)) {
        integrate(scene, pool_, light);
      } else if (pixels <= reference_max) {
        light.kind = TruthKind::reference;
        const auto picture = reference(scene);
        if (!picture) return picture.error();
        for (const std::size_t at : light.pixels) {
          for (std::size_t c = 0; c < 4; ++c) light.rgba.push_back((*picture)[4 * at + c]);
        }
      }
      light.key = std::move(key);
      truth_ = std::move(light);
    }
    result.truth = truth_.kind;
    return {};
  }

  ThreadPool& pool_;
  const CancelToken& cancel_;
  std::vector<CaseResult> cases_;
  std::map<std::string, std::vector<float>> before_;  // of each method, in a monotone sweep
  TrueLight truth_;
};

}  // namespace

std::size_t Extremes::failed() const {
  return static_cast<std::size_t>(std::count_if(
      cases.begin(), cases.end(), [](const CaseResult& one) { return one.failed(); }));
}

Result<Extremes> run_extremes(const std::vector<std::string>& names, ThreadPool& pool,
                              const CancelToken& cancel, const GroupListener& listen) {
  std::vector<const Group*> wanted;
  for (const Group& group : groups()) {
    const bool named = std::find(names.begin(), names.end(), group.name) != names.end();
    if (names.empty() || named) wanted.push_back(&group);
  }
  Battery battery(pool, cancel);
  double done = 0;
  for (const Group* group : wanted) {
    if (listen) listen(group->name, done / static_cast<double>(wanted.size()));
    if (auto ran = battery.run(*group); !ran) return ran.error();
    ++done;
  }
  Extremes extremes = battery.results();
  extremes.trust = trust_of(extremes.cases);
  return extremes;
}

}  // namespace windsplat::study
