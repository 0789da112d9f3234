// The file of a saved view -> the view, written and read again.
#include <cstdint>
#include <string>

#include "protocol/saved_view.hpp"
#include "tests/fuzz/support/check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using fuzz::expect;
  namespace protocol = windsplat::protocol;
  const auto saved = protocol::parse_view_file(fuzz::text_of(data, size));
  if (!saved) {
    expect(!saved.error().message.empty(), "a refusal has a reason");
    return 0;
  }
  expect(protocol::is_view_id(saved->id), "an id has its form", saved->id);
  const std::string file = protocol::encode_view_file(*saved);
  const auto again = protocol::parse_view_file(file);
  expect(again.has_value(), "a written view can be read", file);
  expect(again->id == saved->id && again->created == saved->created &&
             again->view.canonical() == saved->view.canonical() &&
             protocol::encode_view_file(*again) == file,
         "a written view is unchanged", file);
  expect(!protocol::encode_saved_view(*saved, "disk").empty(), "a stored view can be encoded");
  return 0;
}
