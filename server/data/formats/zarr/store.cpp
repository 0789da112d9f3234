#include "server/data/formats/zarr/store.hpp"

#include <limits>
#include <string_view>
#include <utility>

namespace windsplat::data::zarr {

bool is_store(Files& files) {
  if (files.location().kind != Location::Kind::folder) return false;
  return files.exists(".zgroup") || files.exists(".zmetadata") || files.exists(".zarray") ||
         files.exists("zarr.json");
}

Result<std::unique_ptr<Store>> Store::open(std::shared_ptr<Files> files) {
  auto contents = scan_store(*files);
  if (!contents) return contents.error();
  return std::unique_ptr<Store>(new Store(std::move(files), std::move(*contents)));
}

const Array& Store::array_of(int variable) const {
  return contents_.arrays.at(static_cast<std::size_t>(variable));
}

cf::Numbers Store::numbers(int variable, const char* attribute) const {
  const Array& array = array_of(variable);
  cf::Numbers out;
  const auto add = [&](const Json& json) {
    if (const auto value = as_number(json)) {
      out.values.push_back(*value);
      out.floating = out.floating || !json.is_integer;
    }
  };
  if (const Json* found = array.attributes.find(attribute)) {
    add(*found);
    for (const Json& entry : found->list) add(entry);
  }
  const auto& fill = array.metadata.fill_value;
  const std::string_view name = attribute;
  // Coordinates have no missing values; their fill_value is a default of the writer.
  const bool masks = fill && !array.is_coordinate() && !array.is_fill_a_number();
  if (name == "_FillValue" && out.values.empty()) {
    // NaN matches no value, which disables the default fill values of netCDF.
    out.values.push_back(masks ? *fill : std::numeric_limits<double>::quiet_NaN());
    out.floating = array.metadata.dtype.kind == 'f';
  } else if (name == "missing_value" && masks) {
    out.values.push_back(*fill);
  }
  return out;
}

std::string Store::text_of(int variable, const char* attribute) const {
  return text_in(array_of(variable).attributes, attribute);
}

}  // namespace windsplat::data::zarr
