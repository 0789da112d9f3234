// Subjects of a study (a dataset and a view of it, by name) and their scenes at any setting.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/study/types.hpp"

namespace windsplat::study {

struct Subject {
  std::string name;
  protocol::View view;  // completed; with the picture size of the study
  std::shared_ptr<data::Dataset> dataset;
  bool calibrated = true;  // whether the study checks its reported errors
};

struct PictureSize {
  int width = 160;
  int height = 120;
};

// soft, dense and stiff (lines in a medium of optical depth 1, 10, and many per cell behind a step
// edge), vectors, scalar, climate, tornado, efield.
std::vector<std::string> standard_names();

// Pictures of 128 x 128 for the blobs and 160 x 120 for the samples; half of both if `quick`.
// Errors: not_found for any other name; those of the samples.
Result<Subject> standard_subject(const std::string& name, bool quick);

// Any dataset with any view, except the picture size; seen obliquely if the view has no eye, target
// and height. Errors: those of scene::complete().
Result<Subject> make_subject(const std::string& name, std::shared_ptr<data::Dataset> dataset,
                             const protocol::View& view, PictureSize size);

// The varied parameters of a completed view.
Knobs own_knobs(const protocol::View& view);
Knobs own_knobs(const Subject& subject);

// The subject at a setting: its picture is knobs.width wide, and its lines are scaled with it.
// Stride and span apply to every layer of the view. Errors: those of build_scene().
Result<scene::Scene> scene_at(const Subject& subject, const Setting& setting);

}  // namespace windsplat::study
