// Generated scenes of many kinds, to which nothing is tuned (bench_frame --scenes).
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::bench {

enum class Content { lines, medium, both };

struct GeneratedScene {
  std::string name;
  std::vector<Content> contents;
  // Every dimension divided by `reduction`.
  std::function<std::unique_ptr<data::Dataset>(int reduction)> open;
  protocol::GeometryView geometry = {};
  bool every_line = true;   // above a thousandth of the range, not only those of default views
  double cloudy_share = 0;  // share of the samples with a medium; 0: as in default views
  bool naive = true;        // the naive renderer takes seconds, not minutes
};

// `side`: samples along each side of the two large cubes; 512 takes 4 GB.
std::vector<GeneratedScene> generated_scenes(int side);

struct Size {
  int width, height;
};

// Seen from azimuth 20, elevation 35 (degrees).
scene::CompletedView completed_view_of(const GeneratedScene& scene, data::Dataset& dataset,
                                       Content content, const Size& size,
                                       protocol::MethodName method, protocol::Detail detail);

// The same with every sample.
scene::Scene scene_of(const GeneratedScene& scene, data::Dataset& dataset, Content content,
                      const Size& size, protocol::MethodName method);

}  // namespace windsplat::bench
