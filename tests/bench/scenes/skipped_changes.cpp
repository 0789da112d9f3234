// Trial fields -> views -> frames with reports -> ratios to the truth.
#include "tests/bench/scenes/skipped_changes.hpp"

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <string>

#include "server/base/thread_pool.hpp"
#include "server/engine/render.hpp"
#include "server/frame/content.hpp"
#include "server/frame/frame.hpp"
#include "server/frame/measure.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/bench/left_out_table.hpp"
#include "tests/bench/support.hpp"
#include "tests/numerics/trial_fields.hpp"

namespace windsplat::bench {
namespace {

struct Range {
  double low = 1e300;
  double high = 0;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] std::string text(const char* format) const {
    return number(format, low) + " to " + number(format, high);
  }
};

struct Ranges {
  Range truth;      // mean change of the picture
  Range bound;      // work.skippedBound over it
  Range measured;   // measured_skipped_change over it
  Range estimated;  // that of a view that was described; 0: none
  Range updates;    // of pixels: with everything over the picture
  Range time;       // of measuring the change over that of measuring the error
};

// Milliseconds of all threads of this process.
double processor_ms() {
  timespec at{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
  return 1e3 * static_cast<double>(at.tv_sec) + 1e-6 * static_cast<double>(at.tv_nsec);
}

class TrialViews {
 public:
  TrialViews(const test::TrialField& field, int height) : field_(field), height_(height) {}

  Ranges run() {
    const auto dataset = test::trial_dataset(field_);
    for (const auto method : {protocol::MethodName::kernel, protocol::MethodName::slab}) {
      for (const bool cloud : {false, true}) {
        protocol::View view;
        view.dataset = field_.name;
        view.image.height = height_;
        view.image.width = height_ * 4 / 3;
        view.method.name = method;
        if (!cloud) view.scalars.emplace();
        const auto completed = value_or_give_up(scene::complete(view, *dataset));
        for (const double azimuth : {0.0, 70.0}) {
          add(value_or_give_up(completed.with([&](protocol::View& by) {
                scene::orbit(by, completed.lattice(), azimuth, 20, 1);
              })),
              *dataset);
        }
      }
    }
    return ranges_;
  }

 private:
  void add(const scene::CompletedView& completed, data::Dataset& dataset) {
    frame::Encoding encoding;
    encoding.format = frame::Format::npy;
    encoding.measure = true;
    const auto prepared = value_or_give_up(
        frame::prepare(completed, frame::own_setting(completed), dataset, encoding));
    const auto done = frame::draw(prepared, dataset, pool_, {}, space_);
    if (!done) give_up(done.error().message);
    const frame::Frame& drawn = space_.drawn;
    scene::Scene whole = prepared.scene;
    whole.vector->min_magnitude = 0;
    for (auto& layer : whole.scalars) layer.min_optical_depth = 0;
    const auto everything = value_or_give_up(engine::render(whole, pool_, {}));
    const double truth = apart(space_.space.image().rgba, everything.image.rgba).mean;
    ranges_.truth.add(truth);
    ranges_.bound.add(drawn.work.skipped_bound / truth);
    const auto content = frame::content_of(prepared.scene);
    ranges_.estimated.add(content->skipped_change.value_or(0) / truth);
    ranges_.updates.add(static_cast<double>(everything.work.pixel_updates) /
                        static_cast<double>(drawn.work.pixel_updates));
    const double start = processor_ms();
    const double change =
        value_or_give_up(frame::measured_skipped_change(prepared, pool_, {}, space_));
    const double between = processor_ms();
    value_or_give_up(frame::measured_error(prepared, dataset, pool_, {}, space_));
    ranges_.measured.add(change / truth);
    ranges_.time.add((between - start) / (processor_ms() - between));
  }

  const test::TrialField field_;
  int height_;
  ThreadPool pool_{1};
  frame::Workspace space_;
  Ranges ranges_;
};

}  // namespace

Table skipped_changes(int height, const std::string& only, const std::vector<int>& reductions) {
  Table table{
      {"field", "samples", "change", "bound", "measured", "estimated", "pixel updates", "time"}};
  for (const int reduction : reductions) {
    for (test::TrialField field : test::trial_fields()) {
      if (!only.empty() && field.name != only) continue;
      for (int& samples : field.dims) samples /= reduction;
      const Ranges found = TrialViews(field, height).run();
      table.push_back({field.name, reduction == 1 ? "all" : "1/" + std::to_string(reduction),
                       found.truth.text("%.2g"), found.bound.text("%.2g"),
                       found.measured.text("%.4f"), found.estimated.text("%.2f"),
                       found.updates.text("%.1f"), found.time.text("%.2f")});
    }
  }
  return table;
}

}  // namespace windsplat::bench
