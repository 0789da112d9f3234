#include "server/data/formats/zarr/store.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

namespace windsplat::data::zarr {

bool is_store(Files& files) {
  if (files.location().kind != Location::Kind::folder) return false;
  constexpr auto names =
      std::to_array<const char*>({"zarr.json", ".zgroup", ".zmetadata", ".zarray"});
  for (const char* const name : names) files.expect({.name = name});  // at the same time
  return std::any_of(names.begin(), names.end(),
                     [&](const char* name) { return files.exists(name); });
}

Result<std::unique_ptr<Store>> Store::open(std::shared_ptr<Files> files,
                                           std::unique_ptr<LevelStore>* levels) {
  auto contents = scan_store(*files);
  if (!contents) return contents.error();
  if (levels != nullptr && contents->levels) {
    auto out = std::make_unique<LevelStore>();
    out->names = std::move(*contents->levels);
    StoreContents others;
    others.version = contents->version;
    others.name = contents->name;
    others.arrays = std::move(contents->level_arrays);
    for (const Array& array : contents->arrays) {
      out->finest.emplace(array.name, array);
      if (!array.is_coordinate()) continue;
      others.arrays.push_back(array);
      others.arrays.back().name = array.path.substr(0, array.path.size() - 1);
    }
    for (const Array& array : others.arrays) {
      out->indices.emplace(array.name, static_cast<int>(out->metadata.size()));
      out->metadata.push_back(array.metadata);
    }
    out->arrays.reset(new Store(files, std::move(others)));
    *levels = std::move(out);
  }
  return std::unique_ptr<Store>(new Store(std::move(files), std::move(*contents)));
}

namespace {

// A _FillValue as xarray writes it to version 3: base64 of the 8 little-endian bytes of a double.
std::optional<double> float_in_base64(std::string_view text) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  if (text.size() != 12 || text.back() != '=') return {};
  std::array<unsigned char, 9> bytes{};
  for (std::size_t i = 0; i < 12; i += 4) {
    std::uint32_t three = 0;
    for (const char c : text.substr(i, 4)) {
      const std::size_t digit = c == '=' && i == 8 ? 0 : digits.find(c);
      if (digit == std::string_view::npos) return {};
      three = three << 6U | static_cast<std::uint32_t>(digit);
    }
    for (std::size_t b = 0; b < 3; ++b) {
      bytes.at(i / 4 * 3 + b) = static_cast<unsigned char>(three >> (16 - 8 * b));
    }
  }
  double out = 0;
  std::memcpy(&out, bytes.data(), sizeof out);
  return out;
}

}  // namespace

const Array& Store::array_of(int variable) const {
  return contents_.arrays.at(static_cast<std::size_t>(variable));
}

cf::Numbers Store::numbers(int variable, const char* attribute) const {
  const Array& array = array_of(variable);
  cf::Numbers out;
  const auto add = [&](const Json& json) {
    const auto encoded = contents_.version == 3 ? float_in_base64(json.text) : std::nullopt;
    if (const auto value = encoded ? encoded : as_number(json)) {
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
  // Coordinates have no missing values; their fill_value is a default of the writer. In version 3
  // it is that of every array.
  const bool masks =
      contents_.version == 2 && fill && !array.is_coordinate() && !array.is_fill_a_number();
  if (name == "_FillValue" && out.values.empty()) {
    // A NaN fill value matches no number, which disables the default fill values of netCDF.
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
