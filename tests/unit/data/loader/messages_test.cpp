// Validation of loader messages: valid ones survive a round trip, and no mutation violates the
// invariants of the program.
#include "server/data/loader/messages.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

namespace windsplat::data::loader {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Axis axis(const char* name, AxisKind kind, std::vector<double> coordinates) {
  Axis out;
  out.name = name;
  out.standard_name = std::string("standard ") + name;
  out.units = "m";
  out.kind = kind;
  out.coordinates = std::move(coordinates);
  return out;
}

DatasetInfo good() {
  DatasetInfo info;
  info.id = "id";
  info.title = "A title";
  info.source = "file.nc";
  info.format = "netCDF-4";
  info.digest = "0123";
  info.time_units = "days since 2000-01-01";
  info.time_calendar = "noleap";
  info.grid.axes = {axis("lon", AxisKind::longitude, {-10, 0, 20}),
                    axis("lat", AxisKind::latitude, {40, 41}),
                    axis("lev", AxisKind::pressure, {1000, 500, 200, 50})};
  auto columns = std::make_shared<Columns>();
  columns->longitude = {1, 2, 3, 4, 5, 6};
  columns->latitude = {7, 8, 9, 10, 11, 12};
  info.grid.columns = columns;
  const float open = std::numeric_limits<float>::quiet_NaN();
  info.grid.ground = std::make_shared<const Ground>(
      Ground{"deptho", GroundKind::sea_floor, {-5, -7, open, 0, 2, -9}});
  FieldInfo wind;
  wind.name = "wind";
  wind.kind = FieldKind::vector;
  wind.components = {"u", "v", "w"};
  wind.component_units = {"m s-1", "m s-1", "Pa s-1"};
  wind.units = "m s-1";
  wind.dtype = "float32";
  FieldInfo heat;
  heat.name = "T";
  heat.components = {"T"};
  heat.component_units = {"K"};
  heat.units = "K";
  heat.standard_name = "air_temperature";
  heat.long_name = "Temperature";
  heat.dtype = "int16 packed";
  heat.decoded_bytes = 96;
  heat.chunk_bytes = 48;
  heat.box_chunk = {3, 1, 2};
  heat.box_chunk_first = {2, 0, 1};
  info.fields = {wind, heat};
  info.left_out = {{"x", "not a number"}, {"y", "on another grid"}};
  info.notes = {"resampled"};
  info.choices = {{"number", 3, {"0", "1", "2"}, "2"}};
  info.steps = {{0.5, "2000-01-01T12:00:00Z"}, {1.5, "2000-01-02T12:00:00Z"}};
  StoredLevels stored;  // of 3 x 2 x 4 samples
  stored.levels = {{0, 0, 0}, {1, 1, 1}};
  stored.widths[2] = {1, 2, 3, 4};
  stored.fields.resize(2);
  stored.fields[1].has_levels = true;
  stored.fields[1].ranges = {{{1, 2}, 3}, {{0, 0}, 24}};
  info.stored = std::make_shared<const StoredLevels>(stored);
  return info;
}

// The invariants of the program, stated independently.
void expect_sound(const DatasetInfo& info) {
  double samples = 1;
  for (const Axis& a : info.grid.axes) {
    ASSERT_FALSE(a.coordinates.empty());
    ASSERT_LE(static_cast<int>(a.kind), static_cast<int>(AxisKind::cartesian));
    samples *= static_cast<double>(a.coordinates.size());
    for (std::size_t i = 0; i < a.coordinates.size(); ++i) {
      ASSERT_TRUE(std::isfinite(a.coordinates[i]));
      if (i < 2) continue;
      ASSERT_EQ(a.coordinates[i] > a.coordinates[i - 1], a.coordinates[1] > a.coordinates[0]);
      ASSERT_NE(a.coordinates[i], a.coordinates[i - 1]);
    }
  }
  ASSERT_LE(samples, 68719476736.0);
  if (info.grid.columns) {
    const std::size_t layer =
        info.grid.axes[0].coordinates.size() * info.grid.axes[1].coordinates.size();
    ASSERT_EQ(info.grid.columns->longitude.size(), layer);
    ASSERT_EQ(info.grid.columns->latitude.size(), layer);
    for (std::size_t i = 0; i < layer; ++i) {
      ASSERT_TRUE(std::isfinite(info.grid.columns->longitude[i]));
      ASSERT_TRUE(std::isfinite(info.grid.columns->latitude[i]));
    }
  }
  if (const auto& ground = info.grid.ground) {
    ASSERT_EQ(ground->heights.size(),
              info.grid.axes[0].coordinates.size() * info.grid.axes[1].coordinates.size());
    for (const float z : ground->heights) ASSERT_FALSE(std::isinf(z));
    ASSERT_TRUE(ground->kind == GroundKind::land || ground->kind == GroundKind::sea_floor);
    ASSERT_EQ(printable(ground->name, 1000000), ground->name);
  }
  ASSERT_FALSE(info.steps.empty());
  for (const TimeStep& step : info.steps) ASSERT_TRUE(std::isfinite(step.value));
  ASSERT_FALSE(info.fields.empty());
  for (const FieldInfo& field : info.fields) {
    ASSERT_FALSE(field.name.empty());
    ASSERT_EQ(printable(field.name, 1000000), field.name);
    ASSERT_EQ(field.component_units.size(), field.components.size());
    ASSERT_GE(field.components.size(), field.kind == FieldKind::scalar ? 1U : 2U);
    ASSERT_LE(field.components.size(), field.kind == FieldKind::scalar ? 1U : 3U);
    for (std::size_t a = 0; a < 3; ++a) {
      ASSERT_EQ(field.box_chunk.at(a) > 0, field.is_read_by_boxes());
      ASSERT_GE(field.box_chunk.at(a), 0);
      ASSERT_LE(field.box_chunk.at(a), info.grid.dims().at(a));
      ASSERT_GE(field.box_chunk_first.at(a), 0);
      ASSERT_LT(field.box_chunk_first.at(a), std::max(1, field.box_chunk.at(a)));
    }
  }
}

TEST(LoaderMessages, InfoSurvivesARoundTrip) {
  const DatasetInfo info = good();
  auto out = decode_info(encode_info(info));
  ASSERT_TRUE(out) << out.error().message;
  EXPECT_EQ(out->id, info.id);
  EXPECT_EQ(out->title, info.title);
  EXPECT_EQ(out->source, info.source);
  EXPECT_EQ(out->format, info.format);
  EXPECT_EQ(out->digest, info.digest);
  EXPECT_EQ(out->time_units, info.time_units);
  EXPECT_EQ(out->time_calendar, info.time_calendar);
  for (std::size_t a = 0; a < 3; ++a) {
    EXPECT_EQ(out->grid.axes[a].name, info.grid.axes[a].name);
    EXPECT_EQ(out->grid.axes[a].standard_name, info.grid.axes[a].standard_name);
    EXPECT_EQ(out->grid.axes[a].units, info.grid.axes[a].units);
    EXPECT_EQ(out->grid.axes[a].kind, info.grid.axes[a].kind);
    EXPECT_EQ(out->grid.axes[a].coordinates, info.grid.axes[a].coordinates);
  }
  ASSERT_TRUE(out->grid.columns);
  EXPECT_EQ(out->grid.columns->longitude, info.grid.columns->longitude);
  EXPECT_EQ(out->grid.columns->latitude, info.grid.columns->latitude);
  ASSERT_TRUE(out->grid.ground);
  EXPECT_EQ(out->grid.ground->name, "deptho");
  EXPECT_EQ(out->grid.ground->kind, GroundKind::sea_floor);
  ASSERT_EQ(out->grid.ground->heights.size(), 6U);
  for (const std::size_t c : {0, 1, 3, 4, 5}) {
    EXPECT_EQ(out->grid.ground->heights[c], info.grid.ground->heights[c]);
  }
  EXPECT_TRUE(std::isnan(out->grid.ground->heights[2]));
  ASSERT_EQ(out->fields.size(), 2U);
  for (std::size_t f = 0; f < 2; ++f) {
    EXPECT_EQ(out->fields[f].name, info.fields[f].name);
    EXPECT_EQ(out->fields[f].kind, info.fields[f].kind);
    EXPECT_EQ(out->fields[f].components, info.fields[f].components);
    EXPECT_EQ(out->fields[f].component_units, info.fields[f].component_units);
    EXPECT_EQ(out->fields[f].units, info.fields[f].units);
    EXPECT_EQ(out->fields[f].standard_name, info.fields[f].standard_name);
    EXPECT_EQ(out->fields[f].long_name, info.fields[f].long_name);
    EXPECT_EQ(out->fields[f].dtype, info.fields[f].dtype);
    EXPECT_EQ(out->fields[f].decoded_bytes, info.fields[f].decoded_bytes);
    EXPECT_EQ(out->fields[f].chunk_bytes, info.fields[f].chunk_bytes);
    EXPECT_EQ(out->fields[f].box_chunk, info.fields[f].box_chunk);
    EXPECT_EQ(out->fields[f].box_chunk_first, info.fields[f].box_chunk_first);
  }
  ASSERT_EQ(out->left_out.size(), 2U);
  EXPECT_EQ(out->left_out[1].name, "y");
  EXPECT_EQ(out->left_out[1].reason, "on another grid");
  EXPECT_EQ(out->notes, info.notes);
  ASSERT_EQ(out->choices.size(), 1U);
  EXPECT_EQ(out->choices[0].name, "number");
  EXPECT_EQ(out->choices[0].length, 3U);
  EXPECT_EQ(out->choices[0].values, info.choices[0].values);
  EXPECT_EQ(out->choices[0].chosen, "2");
  ASSERT_EQ(out->steps.size(), 2U);
  EXPECT_EQ(out->steps[1].value, 1.5);
  EXPECT_EQ(out->steps[1].text, "2000-01-02T12:00:00Z");
  ASSERT_TRUE(out->stored);
  EXPECT_EQ(out->stored->levels, info.stored->levels);
  EXPECT_EQ(out->stored->widths, info.stored->widths);
  ASSERT_EQ(out->stored->fields.size(), 2U);
  EXPECT_FALSE(out->stored->fields[0].has_levels);
  EXPECT_TRUE(out->stored->fields[1].has_levels);
  ASSERT_NE(stored_range(*out, 1, 0), nullptr);
  EXPECT_EQ(stored_range(*out, 1, 0)->range, (std::array{1.0F, 2.0F}));
  EXPECT_EQ(stored_range(*out, 1, 1)->masked, 24);
}

TEST(LoaderMessages, ValuesNoReaderReportsAreRefused) {
  const std::vector<std::pair<const char*, void (*)(DatasetInfo&)>> lies{
      {"no steps", [](DatasetInfo& i) { i.steps.clear(); }},
      {"a choice without values", [](DatasetInfo& i) { i.choices[0].values.clear(); }},
      {"a choice with more values than entries", [](DatasetInfo& i) { i.choices[0].length = 2; }},
      {"a choice beyond the numbers of JSON",
       [](DatasetInfo& i) { i.choices[0].length = std::size_t{1} << 60; }},
      {"too many choices", [](DatasetInfo& i) { i.choices.resize(choices_max + 1, i.choices[0]); }},
      {"no fields", [](DatasetInfo& i) { i.fields.clear(); }},
      {"a step without a time", [](DatasetInfo& i) { i.steps[1].value = std::nan(""); }},
      {"an axis without coordinates", [](DatasetInfo& i) { i.grid.axes[2].coordinates.clear(); }},
      {"equal coordinates", [](DatasetInfo& i) { i.grid.axes[2].coordinates[1] = 1000; }},
      {"a change of direction", [](DatasetInfo& i) { i.grid.axes[2].coordinates[3] = 2000; }},
      {"an infinite coordinate", [](DatasetInfo& i) { i.grid.axes[0].coordinates[2] = infinity; }},
      {"coordinates too close together",
       [](DatasetInfo& i) {
         i.grid.axes[0].coordinates = {0, 5e-324, 1e-323};
       }},
      {"from east to west",
       [](DatasetInfo& i) {
         i.grid.axes[0].coordinates = {20, 0, -10};
       }},
      {"an axis of unknown kind", [](DatasetInfo& i) { i.grid.axes[0].kind = AxisKind(7); }},
      {"a scalar of two components", [](DatasetInfo& i) { i.fields[0].kind = FieldKind::scalar; }},
      {"a vector of one component", [](DatasetInfo& i) { i.fields[1].kind = FieldKind::vector; }},
      {"a vector of four components",
       [](DatasetInfo& i) {
         i.fields[0].components.emplace_back("t");
         i.fields[0].component_units.emplace_back("s");
       }},
      {"a missing unit", [](DatasetInfo& i) { i.fields[0].component_units.pop_back(); }},
      {"a field without a name", [](DatasetInfo& i) { i.fields[0].name.clear(); }},
      {"a column without a position",
       [](DatasetInfo& i) {
         auto columns = std::make_shared<Columns>(*i.grid.columns);
         columns->latitude[3] = std::nan("");
         i.grid.columns = columns;
       }},
      {"a missing column",
       [](DatasetInfo& i) {
         auto columns = std::make_shared<Columns>(*i.grid.columns);
         columns->longitude.pop_back();
         i.grid.columns = columns;
       }},
      {"a ground of infinite height",
       [](DatasetInfo& i) {
         auto ground = std::make_shared<Ground>(*i.grid.ground);
         ground->heights[1] = std::numeric_limits<float>::infinity();
         i.grid.ground = ground;
       }},
      {"a ground without a column",
       [](DatasetInfo& i) {
         auto ground = std::make_shared<Ground>(*i.grid.ground);
         ground->heights.pop_back();
         i.grid.ground = ground;
       }},
      {"more samples than allowed",
       [](DatasetInfo& i) {
         for (Axis& a : i.grid.axes) {
           a.coordinates.resize(1300);
           for (std::size_t k = 0; k < 1300; ++k) a.coordinates[k] = static_cast<double>(k);
         }
         i.grid.columns = nullptr;
         i.grid.ground = nullptr;
       }},
  };
  for (const auto& [what, lie] : lies) {
    DatasetInfo info = good();
    lie(info);
    EXPECT_FALSE(decode_info(encode_info(info))) << what;
  }
}

TEST(LoaderMessages, MissingOrExtraPartsAreRefused) {
  const std::string message = encode_info(good());
  for (std::size_t size = 0; size < message.size(); ++size) {
    EXPECT_FALSE(decode_info(std::string_view(message).substr(0, size))) << size;
  }
  EXPECT_FALSE(decode_info(message + '\0'));
}

TEST(LoaderMessages, ControlCharactersAreEscaped) {
  DatasetInfo info = good();
  info.title = "a\nb\x1b[2J";
  info.fields[1].name = std::string("T\0", 2);
  auto out = decode_info(encode_info(info));
  ASSERT_TRUE(out);
  EXPECT_EQ(out->title, "a\\x0ab\\x1b[2J");
  EXPECT_EQ(out->fields[1].name, "T\\x00");
}

TEST(LoaderMessages, NoMutationOfAnInfoViolatesItsInvariants) {
  const std::string message = encode_info(good());
  std::mt19937 random(20240607);
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  const std::vector<std::uint64_t> extremes{0,
                                            1,
                                            2,
                                            0x7fffffff,
                                            0xffffffff,
                                            std::uint64_t{1} << 32,
                                            std::uint64_t{1} << 61,
                                            ~std::uint64_t{0},
                                            0x7ff0000000000000,
                                            0x7ff8000000000000};
  int accepted = 0;
  for (int round = 0; round < 50'000; ++round) {
    std::string changed = message;
    for (std::size_t n = 1 + pick(3); n > 0; --n) {
      const std::size_t at = pick(changed.size());
      switch (pick(4)) {
        case 0:
          changed[at] = static_cast<char>(random());
          break;
        case 1: {
          const std::uint64_t value = extremes[pick(extremes.size())];
          if (at + 8 <= changed.size()) std::memcpy(&changed[at], &value, 8);
          break;
        }
        case 2:
          changed.erase(at, 1 + pick(9));
          break;
        default:
          changed.insert(at, changed.substr(pick(changed.size()), 1 + pick(9)));
      }
      if (changed.empty()) changed = message;
    }
    auto out = decode_info(changed);
    if (!out) continue;
    ++accepted;
    expect_sound(*out);
    if (HasFatalFailure()) FAIL() << "round " << round;
  }
  EXPECT_GT(accepted, 1000);  // changed letters and digits are valid
}

TEST(LoaderMessages, OnlyKindAndMessageOfErrorsPass) {
  const Error wrong = make_error(ErrorKind::out_of_memory, "no memory");
  EXPECT_EQ(decode_error(encode_error(wrong)).kind, ErrorKind::out_of_memory);
  EXPECT_EQ(decode_error(encode_error(wrong)).message, "no memory");
  // For example, a loader must not be able to report that the server is shutting down.
  EXPECT_EQ(decode_error(encode_error(make_error(ErrorKind::draining, "x"))).kind,
            ErrorKind::bad_data);
  EXPECT_EQ(decode_error(encode_error(make_error(ErrorKind::bad_data, "a\nb"))).message, "a\\x0ab");
  EXPECT_EQ(decode_error("").kind, ErrorKind::bad_data);
}

TEST(LoaderMessages, TaskContainsNamesButNoPaths) {
  Task task;
  task.memory_bytes = 77;
  task.library_folders = {"/usr/share/tables"};
  task.location.kind = Location::Kind::series;
  task.location.companions = true;
  task.location.fetched = true;
  task.location.stem = "stem";
  task.location.inside = "a/b";
  task.location.pattern = "*.nc";
  task.location.list = R"({"files": ["a.nc"]})";
  task.location.selection = {{"number", "3"}, {"band", "2"}};
  task.location.members = {{"a.nc", "/secret/a.nc"}, {"b.nc", "/secret/b.nc"}};
  const std::string bytes = encode_task(task);
  EXPECT_EQ(bytes.find("secret"), std::string::npos);
  auto out = decode_task(bytes);
  ASSERT_TRUE(out);
  EXPECT_EQ(out->memory_bytes, 77U);
  EXPECT_EQ(out->library_folders, task.library_folders);
  EXPECT_EQ(out->location.kind, Location::Kind::series);
  EXPECT_TRUE(out->location.companions);
  EXPECT_TRUE(out->location.fetched);
  EXPECT_EQ(out->location.stem, "stem");
  EXPECT_EQ(out->location.inside, "a/b");
  EXPECT_EQ(out->location.pattern, "*.nc");
  EXPECT_EQ(out->location.list, task.location.list);
  EXPECT_EQ(selection_text(out->location.selection), "number=3,band=2");
  ASSERT_EQ(out->location.members.size(), 2U);
  EXPECT_EQ(out->location.members[1].name, "b.nc");
}

TEST(LoaderMessages, ChunksThatNoGridHasAreRefused) {
  const std::vector<std::pair<const char*, void (*)(DatasetInfo&)>> lies{
      {"a chunk longer than the grid", [](DatasetInfo& i) { i.fields[1].box_chunk[1] = 3; }},
      {"a chunk of negative length",
       [](DatasetInfo& i) {
         i.fields[1].box_chunk = {-1, -1, -1};
       }},
      {"a chunk without length along one axis",
       [](DatasetInfo& i) {
         i.fields[1].box_chunk[2] = 0;
         i.fields[1].box_chunk_first[2] = 0;
       }},
      {"a chunk along one axis only", [](DatasetInfo& i) { i.fields[0].box_chunk[2] = 1; }},
      {"a chunk that begins behind its end",
       [](DatasetInfo& i) { i.fields[1].box_chunk_first[2] = 2; }},
      {"a chunk that begins before the grid",
       [](DatasetInfo& i) { i.fields[1].box_chunk_first[0] = -1; }},
  };
  for (const auto& [what, lie] : lies) {
    DatasetInfo info = good();
    lie(info);
    EXPECT_FALSE(decode_info(encode_info(info))) << what;
  }
}

TEST(LoaderMessages, WantedSurvivesARoundTrip) {
  const DatasetInfo info = good();
  for (const Wanted& wanted : {Wanted{0, 1, {whole_box({3, 2, 4})}, 2, true},
                               Wanted{1, 0, {{{1, 0, 2}, {2, 1, 2}}}, 0, false},
                               Wanted{1, 1, {{{1, 0, 0}, {1, 1, 2}}, 1, StoredAs::two_values}}}) {
    const auto out = decode_wanted(encode_wanted(wanted), info);
    ASSERT_TRUE(out) << out.error().message;
    EXPECT_EQ(out->field, wanted.field);
    EXPECT_EQ(out->step, wanted.step);
    EXPECT_EQ(out->part, wanted.part);
    EXPECT_EQ(out->window_layers, wanted.window_layers);
    EXPECT_EQ(out->keeps_memory, wanted.keeps_memory);
  }
}

TEST(LoaderMessages, WhatTheDatasetLacksIsNotRead) {
  const DatasetInfo info = good();
  const std::vector<std::pair<const char*, void (*)(Wanted&)>> faults{
      {"a field beyond the last", [](Wanted& w) { w.field = 2; }},
      {"a step beyond the last", [](Wanted& w) { w.step = 2; }},
      {"a box that begins before the grid", [](Wanted& w) { w.part.box.first[0] = -1; }},
      {"a box that ends behind the grid", [](Wanted& w) { w.part.box.count[2] = 3; }},
      {"a box without samples", [](Wanted& w) { w.part.box.count[1] = 0; }},
      {"a level beyond the last",
       [](Wanted& w) {
         w.part = {{}, 2, StoredAs::two_values};
       }},
      {"draws of a scalar",
       [](Wanted& w) {
         w.part = {{}, 1, StoredAs::drawn};
       }},
      {"samples of a level",
       [](Wanted& w) {
         w.part = {{}, 1, StoredAs::samples};
       }},
      {"two values of level 0",
       [](Wanted& w) {
         w.part = {{}, 0, StoredAs::two_values};
       }},
      {"what nothing is stored as",
       [](Wanted& w) {
         w.part = {{}, 1, static_cast<StoredAs>(9)};
       }},
      {"a box beyond its level",
       [](Wanted& w) {
         w.part = {{{1, 0, 0}, {2, 1, 1}}, 1, StoredAs::two_values};
       }},
      {"a box in parts", [](Wanted& w) { w.window_layers = 1; }},
      {"a box of a field that is not read by boxes", [](Wanted& w) { w.field = 0; }},
  };
  const Wanted fine{1, 0, {{{1, 0, 2}, {2, 1, 2}}}, 0, false};
  ASSERT_TRUE(decode_wanted(encode_wanted(fine), info));
  for (const auto& [what, change] : faults) {
    Wanted wanted = fine;
    change(wanted);
    EXPECT_FALSE(decode_wanted(encode_wanted(wanted), info)) << what;
  }
  EXPECT_FALSE(decode_wanted(encode_wanted(fine).substr(1), info));
  EXPECT_FALSE(decode_wanted(encode_wanted(fine) + "x", info));
}

TEST(LoaderMessages, WhatIsExpectedArrivesUnlessItIsMalformed) {
  const Expected sent{"u/c/0", true, 20, {{5, 9}, {0, ~std::uint64_t{0}}}};
  const std::string bytes = encode_expected(sent);
  const auto got = decode_expected(bytes);
  ASSERT_TRUE(got);
  EXPECT_EQ(got->name, sent.name);
  EXPECT_TRUE(got->in_parts);
  EXPECT_EQ(got->tail_bytes, 20U);
  ASSERT_EQ(got->extents.size(), 2U);
  EXPECT_EQ(got->extents[0].begin, 5U);
  EXPECT_EQ(got->extents[1].end, ~std::uint64_t{0});
  for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
    EXPECT_FALSE(decode_expected(bytes.substr(0, cut))) << cut;
  }
  EXPECT_FALSE(decode_expected(bytes + 'x'));
  Expected many = sent;
  many.extents.resize(expected_extents_max + 1);
  EXPECT_FALSE(decode_expected(encode_expected(many)));
}

}  // namespace
}  // namespace windsplat::data::loader
