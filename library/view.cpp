// A view as the text of the keys that were set, validated at each change.
#include "library/state.hpp"
#include "protocol/codec.hpp"

namespace windsplat {
namespace {

protocol::ViewDocument document_of(const std::string& json) {
  return library::taken(protocol::ViewDocument::parse(json));
}

}  // namespace

View::View() : json_("{}") {}
View::View(const std::string& json) : json_(document_of(json).canonical()) {}
View::View(const View&) = default;
View::View(View&&) noexcept = default;
View& View::operator=(const View&) = default;
View& View::operator=(View&&) noexcept = default;
View::~View() = default;

View& View::set(const std::string& pointer, const std::string& value) {
  json_ = library::taken(protocol::set_at(document_of(json_), pointer, value)).canonical();
  return *this;
}

View& View::size(int width, int height) {
  json_ = library::taken(
              protocol::set_all(document_of(json_), {{"/image/width", std::to_string(width)},
                                                     {"/image/height", std::to_string(height)}}))
              .canonical();
  return *this;
}

View& View::step(int step) { return set("/step", std::to_string(step)); }

std::string View::json() const { return json_; }

}  // namespace windsplat
