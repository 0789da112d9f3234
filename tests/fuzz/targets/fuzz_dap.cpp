// Texts of an OPeNDAP service: descriptions of a dataset (DDS), of an answer, and attributes (DAS).
#include <cstdint>
#include <map>
#include <string>

#include "server/data/formats/dap/das.hpp"
#include "server/data/formats/dap/dds.hpp"
#include "tests/fuzz/support/check.hpp"

namespace {

using fuzz::expect;
namespace dap = windsplat::data::dap;

void expect_array(const dap::Array& array, std::size_t bytes) {
  expect(!array.name.empty() && !array.path.empty(), "an array has a name");
  expect(array.dims.size() <= dap::rank_max, "dimensions are within the limit", array.name);
  expect(array.name.size() + array.path.size() <= 2 * bytes + 1, "names are those of the text");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(fuzz::text_of(data, size));
  if (const auto dds = dap::parse_dds(text)) {
    std::map<std::string, std::uint64_t> lengths;
    expect(dds->arrays.size() <= dap::arrays_max, "arrays are within the limit");
    for (const dap::Array& array : dds->arrays) {
      expect_array(array, size);
      for (const dap::Dimension& dimension : array.dims) {
        const auto known = lengths.emplace(dimension.name, dimension.length).first;
        expect(known->second == dimension.length, "a dimension has one length", dimension.name);
      }
    }
  } else {
    expect(!dds.error().message.empty(), "a refusal has a reason");
  }
  if (const auto sent = dap::parse_sent(text)) expect_array(*sent, size);
  if (const auto das = dap::parse_das(text)) {
    std::size_t count = 0;
    for (const auto& [variable, attributes] : *das) {
      for (const auto& [name, attribute] : attributes) {
        count += attribute.numbers.size() + 1;
        expect(attribute.is_text ? attribute.numbers.empty() : !attribute.numbers.empty(),
               "an attribute is text or numbers", name);
      }
    }
    expect(count <= 2 * dap::attributes_max, "attributes are within the limit");
  }
  return 0;
}
