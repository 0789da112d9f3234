// Report -> the typed values of protocol/study.schema.json.
#pragma once

#include <array>
#include <vector>

#include "protocol/study.hpp"
#include "server/study/study.hpp"

namespace windsplat::study {

inline constexpr std::array<Knob, 5> report_knobs{Knob::stride, Knob::span, Knob::slab_thickness,
                                                  Knob::stop_transmittance, Knob::width};

// Whether the parameter applies to the method of the setting and to the scene.
bool has_knob(const SceneReport& scene, const Setting& setting, Knob knob);

// The document without pictures.
protocol::StudyDocument document_of(const Report& report);

// Errors: internal.
Result<std::vector<protocol::StudyPicture>> encoded_pictures(const SceneReport& scene);

}  // namespace windsplat::study
