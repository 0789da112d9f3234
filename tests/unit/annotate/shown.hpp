// A view of a dataset with everything that a figure is made of.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/annotate/annotate.hpp"
#include "server/annotate/projector.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::annotate {

class Shown {
 public:
  Shown(data::Grid grid, std::vector<data::FieldInfo> fields,
        const std::function<void(protocol::View&)>& change = {}) {
    auto source = std::make_unique<scene::FakeSource>(std::move(grid), std::move(fields), 2);
    dataset_ = scene::dataset_of(std::move(source));
    protocol::View view;
    view.dataset = "fake";
    view.image.width = 640;
    view.image.height = 480;
    if (change) change(view);
    completed_.emplace(scene::complete(view, *dataset_).value());
    scene_.emplace(scene::build_scene(*completed_, *dataset_).value());
  }
  [[nodiscard]] Subject subject() const { return {*completed_, *scene_, dataset_->info()}; }
  [[nodiscard]] const scene::Scene& scene() const { return *scene_; }
  [[nodiscard]] Projector projector() const { return Projector(scene_->camera); }

 private:
  std::unique_ptr<data::Dataset> dataset_;
  std::optional<scene::CompletedView> completed_;
  std::optional<scene::Scene> scene_;
};

inline void show_all(protocol::AnnotationsView& view) {
  for (bool* part : {&view.box, &view.axes, &view.north, &view.scale_bar, &view.legend, &view.title,
                     &view.step_time}) {
    *part = true;
  }
}

inline std::vector<std::string> texts(const std::vector<Item>& items) {
  std::vector<std::string> out;
  for (const Item& item : items) {
    if (const Text* text = std::get_if<Text>(&item)) out.push_back(text->text);
  }
  return out;
}

inline std::vector<Line> lines(const std::vector<Item>& items) {
  std::vector<Line> out;
  for (const Item& item : items) {
    if (const Line* line = std::get_if<Line>(&item)) out.push_back(*line);
  }
  return out;
}

inline Figure empty_figure(const Shown& shown) {
  Figure figure;
  figure.width = shown.scene().camera.width;
  figure.height = shown.scene().camera.height;
  return figure;
}

inline std::vector<data::FieldInfo> one_scalar() {
  return {scene::scalar_info("cloud", "kg m**-3")};
}

}  // namespace windsplat::annotate
