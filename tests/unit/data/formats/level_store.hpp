// A store with levels, written from a plain one by coarsen(), for the tests of its reader.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/coarsen.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/formats/zarr_maker.hpp"

namespace windsplat::data::test {

inline std::string json_list(const std::vector<std::size_t>& numbers) {
  std::string out;
  for (const std::size_t n : numbers) out += (out.empty() ? "" : ",") + std::to_string(n);
  return "[" + out + "]";
}

inline std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  if (at != std::string::npos) text.replace(at, what.size(), by);
  return text;
}

// Two steps of a cloud and a wind on 21 x 13 x 9 samples, of which some are masked; layers have
// different heights.
class LevelStore {
 public:
  static constexpr std::array<std::size_t, 3> sides{21, 13, 9};  // x, y, z
  static constexpr std::size_t steps = 2;

  LevelStore() {
    for (const char* name : {"cloud", "u", "v", "w"}) write_field(name);
    write_axes();
    store_.put("0/zarr.json", group("{}"));
    plain_ = opened(store_.path() + "/0");
    for (std::size_t n = 1; n < levels().size(); ++n) write_level(n);
    write_statistics();
    write_array("0/lev_widths", {sides[2]}, "float64", bytes_of_items(widths()), {"lev"});
    write_root(attribute());
  }

  static std::vector<std::array<int, 3>> levels() {
    return {{0, 0, 0}, {1, 1, 1}, {2, 2, 1}, {3, 2, 2}};
  }
  static std::vector<double> widths() { return {100, 120, 150, 200, 250, 300, 400, 500, 600}; }
  static Coarsening how(std::size_t level, bool drawn, int stride = 1) {
    Coarsening out;
    out.halvings = levels().at(level);
    out.widths = {std::vector<double>(sides[0], 2), std::vector<double>(sides[1], 3), widths()};
    out.reduction = drawn ? Reduction::drawn : Reduction::two_values;
    out.stride = stride;
    return out;
  }
  static std::string attribute() {
    return R"({"store":1,"program":"windsplat 9.9.9","contents":"abc","levels":[)"
           R"({"path":"0","halvings":[0,0,0]},{"path":"1","halvings":[1,1,1]},)"
           R"({"path":"2","halvings":[2,2,1]},{"path":"3","halvings":[3,2,2]}],"fields":[)"
           R"({"name":"wind","components":["u","v","w"],"levels":"drawn","strided":2},)"
           R"({"name":"cloud","components":["cloud"],"levels":"two_values"}],)"
           R"("widths":{"x":null,"y":null,"z":"0/lev_widths"},"statistics":"statistics"})";
  }
  void write_root(const std::string& attribute) const {
    store_.put("zarr.json", group(R"({"windsplat":)" + attribute + "}"));
  }
  void write_array(const std::string& path, const std::vector<std::size_t>& shape,
                   const std::string& type, const std::string& bytes,
                   const std::vector<std::string>& names, const std::string& attributes = "{}",
                   const std::string& fill = R"("NaN")") const {
    std::string dimensions;
    for (const std::string& name : names)
      dimensions += (dimensions.empty() ? "\"" : ",\"") + name + '"';
    store_.put(path + "/zarr.json",
               R"({"zarr_format":3,"node_type":"array","shape":)" + json_list(shape) +
                   R"(,"data_type":")" + type +
                   R"(","chunk_grid":{"name":"regular","configuration":{"chunk_shape":)" +
                   json_list(shape) +
                   R"(}},"chunk_key_encoding":{"name":"default"},"fill_value":)" + fill +
                   R"(,"codecs":[{"name":"bytes","configuration":{"endian":"little"}}],)" +
                   R"("dimension_names":[)" + dimensions + R"(],"attributes":)" + attributes + "}");
    std::string key = "c";
    for (std::size_t d = 0; d < shape.size(); ++d) key += "/0";
    store_.put(path + '/' + key, bytes);
  }

  [[nodiscard]] const ZarrStore& store() const { return store_; }
  [[nodiscard]] const std::string& path() const { return store_.path(); }
  // Level 0, opened alone.
  [[nodiscard]] Source& plain() const { return *plain_; }

 private:
  static std::string group(const std::string& attributes) {
    return R"({"zarr_format":3,"node_type":"group","attributes":)" + attributes + "}";
  }
  static std::vector<std::string> dimensions() { return {"time", "lev", "lat", "lon"}; }

  void write_field(const std::string& name) const {
    std::vector<float> values;
    const auto phase = static_cast<double>(name[0]);
    for (std::size_t n = 0; n < steps * sides[0] * sides[1] * sides[2]; ++n) {
      const double at = static_cast<double>(n);
      const bool masked = n % 17 == 3 || (n / 40) % 5 == 2;
      values.push_back(masked ? kMasked
                              : static_cast<float>(std::sin(phase + at * 0.37) + at / 3000));
    }
    const bool vector = name.size() == 1;
    const std::string mark = vector
                                 ? R"("units":"m s-1","windsplat_vector":"wind )" +
                                       std::string(1, static_cast<char>('0' + name[0] - 'u')) + '"'
                                 : R"("units":"kg kg-1")";
    write_array("0/" + name, {steps, sides[2], sides[1], sides[0]}, "float32",
                bytes_of_items(values), dimensions(), "{" + mark + "}");
  }
  void write_axes() const {
    const auto axis = [&](const std::string& name, const std::vector<double>& values,
                          const std::string& attributes) {
      write_array("0/" + name, {values.size()}, "float64", bytes_of_items(values), {name},
                  attributes);
    };
    axis("time", {0, 6}, R"({"units":"hours since 2001-01-01"})");
    axis("lev", {50, 160, 295, 470, 695, 970, 1320, 1770, 2320},
         R"({"units":"m","axis":"Z","positive":"up","standard_name":"height"})");
    std::vector<double> lat(sides[1]);
    for (std::size_t n = 0; n < lat.size(); ++n) lat[n] = 40 + 0.5 * static_cast<double>(n);
    std::vector<double> lon(sides[0]);
    for (std::size_t n = 0; n < lon.size(); ++n) lon[n] = 5 + 0.5 * static_cast<double>(n);
    axis("lat", lat, R"({"units":"degrees_north"})");
    axis("lon", lon, R"({"units":"degrees_east"})");
  }

  // Arrays of the components of reductions at all steps.
  void write_reduction(const std::string& group, const std::string& field, const Coarsening& how,
                       const std::vector<std::string>& names) const {
    std::vector<std::vector<float>> arrays(names.size());
    std::vector<std::size_t> shape;
    for (std::size_t step = 0; step < steps; ++step) {
      const Volume coarse = coarsen(volume_of(*plain_, field, step), how);
      shape = {steps, static_cast<std::size_t>(coarse.dims[2]),
               static_cast<std::size_t>(coarse.dims[1]), static_cast<std::size_t>(coarse.dims[0])};
      for (std::size_t c = 0; c < names.size(); ++c) {
        const float* const from = coarse.component(static_cast<int>(c));
        arrays[c].insert(arrays[c].end(), from, from + coarse.samples());
      }
    }
    for (std::size_t c = 0; c < names.size(); ++c) {
      write_array(group + names[c], shape, "float32", bytes_of_items(arrays[c]), dimensions());
    }
  }
  void write_level(std::size_t level) const {
    const std::string group = std::to_string(level) + '/';
    write_reduction(group, "cloud", how(level, false),
                    {"cloud_low", "cloud_high", "cloud_low_share", "cloud_high_share"});
    write_reduction(group, "wind", how(level, true), {"u", "v", "w"});
    if (level > 2) return;
    Coarsening middles = how(level, true, 1 << level);
    middles.halvings.fill(static_cast<int>(level));
    write_reduction(group, "wind", middles, {"u_strided", "v_strided", "w_strided"});
  }
  void write_statistics() const {
    for (const char* name : {"cloud", "wind"}) {
      std::vector<float> ranges;
      std::vector<std::uint32_t> masked;
      for (std::size_t step = 0; step < steps; ++step) {
        const Volume volume = volume_of(*plain_, name, step);
        ranges.insert(ranges.end(), volume.range.begin(), volume.range.end());
        masked.push_back(static_cast<std::uint32_t>(volume.masked));
      }
      const std::string path = std::string("statistics/") + name;
      write_array(path + "_range", {steps, 2}, "float32", bytes_of_items(ranges), {"time", "end"});
      write_array(path + "_masked", {steps}, "uint32", bytes_of_items(masked), {"time"}, "{}", "0");
    }
  }

  ZarrStore store_{"levels.zarr", "zarr.json", group("{}")};
  std::unique_ptr<Source> plain_;
};

}  // namespace windsplat::data::test
