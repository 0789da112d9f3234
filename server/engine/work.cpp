// Variant -> text of the report.
#include "server/engine/work.hpp"

namespace windsplat::engine {

namespace {

std::string chosen(const Variant& variant) {
  std::string text;
  if (variant.vector) text = "vector";
  if (variant.scalar) text += variant.vector ? "+scalar" : "scalar";
  if (text.empty()) return variant.surfaces ? "surfaces" : variant.body ? "body" : "empty";
  text += variant.perspective ? " perspective" : " orthographic";
  if (variant.heads) text += " heads";
  if (variant.marks) text += " marks";
  if (variant.moving) text += " moving";
  if (variant.slabs) text += " slabs";
  if (variant.curved) text += " curved";
  if (variant.body) text += " body";
  if (variant.surfaces) text += " surfaces";
  if (variant.lit) text += " lit";
  if (variant.passes > 1) {
    text += " passes=";
    text += std::to_string(variant.passes);
  }
  return text;
}

}  // namespace

std::string text_of(const Variant& variant) {
  if (variant.reference) return "reference double";
  std::string text = chosen(variant);
  text += ' ';
  text += variant.target;
  if (variant.level == std::array{0, 0, 0}) return text;
  for (std::size_t a = 0; a < 3; ++a) {
    text += a == 0 ? " level=" : ",";
    text += std::to_string(variant.level.at(a));
  }
  return text;
}

}  // namespace windsplat::engine
