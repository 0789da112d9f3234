// The annotations of a view <-> JSON tree.
#pragma once

#include <string>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

AnnotationsView read_annotations(const Json& json, const std::string& pointer, Faults& faults);
Json annotations_to_json(const AnnotationsView& annotations);

}  // namespace windsplat::protocol
