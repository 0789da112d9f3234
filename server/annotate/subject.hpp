// What a figure is made of, and how its parts look.
#pragma once

#include <functional>
#include <glm/vec3.hpp>
#include <vector>

#include "server/annotate/figure.hpp"
#include "server/base/cancel.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::annotate {

// A view at the size at which it is drawn, its scene and its dataset.
struct Subject {
  const scene::CompletedView& completed;
  const scene::Scene& scene;
  const data::DatasetInfo& info;
  const data::DatasetInfo* subtracted = nullptr;  // of a difference: the dataset subtracted
  // Whether something opaque lies before each of some places in the world; empty: nowhere.
  std::function<std::vector<bool>(const std::vector<glm::dvec3>&)> hidden = {};
  CancelToken cancel = {};  // ends the search for places of numbers
};

struct Style {
  double text = 13;  // em of texts, pixels
  double line = 1;   // width of lines, pixels
  Color color;       // of lines and texts
  Color quiet;       // of what matters less
  Color rim;         // of the outline of texts; the colour of cards
};
// Sizes follow the picture as radii of lines do: view.annotations.size and part.size, at most 4
// together, times those at a height of 720, and not more than fits the width. A colour that neither
// the part nor the view gives contrasts with the background.
Style style_of(const Subject& subject, const protocol::AnnotationStyleView& part = {});

}  // namespace windsplat::annotate
