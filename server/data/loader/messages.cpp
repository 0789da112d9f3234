// Structures <-> bytes, field by field, in native byte order, because both ends run on the same
// machine.
#include "server/data/loader/messages.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "server/data/cf/grid/grid.hpp"
#include "server/data/loader/bytes.hpp"
#include "server/data/model/axis_check.hpp"

namespace windsplat::data::loader {

namespace {

constexpr std::size_t text_max = std::size_t{1} << 16;
constexpr std::size_t things_max = 1'000'000;  // limits on the numbers of fields, of notes and of
                                               // names in a folder
constexpr std::size_t steps_max = std::size_t{1} << 24;
constexpr std::size_t axis_max = std::size_t{1} << 24;
constexpr std::size_t text_bytes_min = sizeof(std::uint64_t);

// Whether text can be passed on unchanged; otherwise it is escaped (see printable()).
std::string text_of(Reader& in) {
  const std::string text = in.text(text_max);
  // An escaped byte takes four bytes, so that nothing is truncated.
  return printable(text, 4 * text.size() + 1);
}

std::vector<std::string> texts_of(Reader& in) {
  std::vector<std::string> out(in.count(things_max, text_bytes_min));
  for (std::string& text : out) text = text_of(in);
  return out;
}

void put_texts(Writer& out, const std::vector<std::string>& texts) {
  out.count(texts.size());
  for (const std::string& text : texts) out.text(text);
}

Axis axis_of(Reader& in, bool vertical) {
  Axis axis;
  axis.name = text_of(in);
  axis.standard_name = text_of(in);
  axis.units = text_of(in);
  const auto kind = in.number<std::uint8_t>();
  if (kind > static_cast<std::uint8_t>(AxisKind::cartesian)) in.fail();
  axis.kind = static_cast<AxisKind>(in.sound() ? kind : 0);
  axis.coordinates = in.doubles(axis_max);
  const std::vector<double>& at = axis.coordinates;
  // Only a vertical axis may descend: pressure, depth, levels numbered from the top.
  if (!axis_fault(at).empty() || (!vertical && at.back() < at.front())) in.fail();
  return axis;
}

std::shared_ptr<const Columns> columns_of(Reader& in, std::size_t expected) {
  Columns columns;
  columns.longitude = in.doubles(expected);
  columns.latitude = in.doubles(expected);
  const auto fits = [expected](const std::vector<double>& values) {
    return values.size() == expected &&
           std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  };
  if (!fits(columns.longitude) || !fits(columns.latitude)) in.fail();
  return std::make_shared<const Columns>(std::move(columns));
}

std::shared_ptr<const Ground> ground_of(Reader& in, std::size_t expected) {
  Ground ground;
  ground.name = text_of(in);
  const auto kind = in.number<std::uint8_t>();
  if (kind > static_cast<std::uint8_t>(GroundKind::sea_floor)) in.fail();
  ground.kind = static_cast<GroundKind>(in.sound() ? kind : 0);
  ground.heights = in.numbers<float>(expected);
  const auto is_height = [](float z) { return !std::isinf(z); };
  const auto& all = ground.heights;
  if (all.size() != expected || !std::all_of(all.begin(), all.end(), is_height)) in.fail();
  return std::make_shared<const Ground>(std::move(ground));
}

// Each count is at most 2^24, so that the product of two cannot overflow.
Grid grid_of(Reader& in) {
  Grid grid;
  for (std::size_t a = 0; a < 3; ++a) grid.axes.at(a) = axis_of(in, a == 2);
  const std::uint64_t layer =
      std::uint64_t{grid.axes[0].coordinates.size()} * grid.axes[1].coordinates.size();
  if (layer > cf::grid_samples_max ||
      layer * grid.axes[2].coordinates.size() > cf::grid_samples_max) {
    in.fail();
  }
  return grid;
}

// Both along all axes, or neither.
void chunks_of(Reader& in, const std::array<int, 3>& dims, FieldInfo& field) {
  for (std::size_t a = 0; a < 3; ++a) {
    field.box_chunk.at(a) = in.number<std::int32_t>();
    field.box_chunk_first.at(a) = in.number<std::int32_t>();
    const int length = field.box_chunk.at(a);
    const int first = field.box_chunk_first.at(a);
    const bool is_chunk = length > 0 && length <= dims.at(a) && first >= 0 && first < length;
    const bool is_none = length == 0 && first == 0;
    if (!is_chunk && !is_none) in.fail();
    if ((length > 0) != (field.box_chunk[0] > 0)) in.fail();
  }
}

FieldInfo field_of(Reader& in, const std::array<int, 3>& dims, std::uint64_t samples) {
  FieldInfo field;
  field.name = text_of(in);
  const auto kind = in.number<std::uint8_t>();
  field.kind = kind == 0 ? FieldKind::scalar : FieldKind::vector;
  field.components = texts_of(in);
  field.units = text_of(in);
  field.component_units = texts_of(in);
  field.standard_name = text_of(in);
  field.long_name = text_of(in);
  field.dtype = text_of(in);
  const auto derived = in.number<std::uint8_t>();
  field.derived = derived == 1;
  field.decoded_bytes = in.number<std::uint64_t>();
  field.chunk_bytes = in.number<std::uint64_t>();
  chunks_of(in, dims, field);
  const std::size_t count = field.components.size();
  const bool right_count = kind == 0 ? count == 1 : count == 2 || count == 3;
  const bool is_too_large =
      !field.is_read_by_boxes() &&
      samples > volume_bytes_max / sizeof(float) / std::max<std::size_t>(count, 1);
  if (kind > 1 || derived > 1 || !right_count || field.component_units.size() != count ||
      field.name.empty() || is_too_large) {
    in.fail();
  }
  return field;
}

DimensionChoice choice_of(Reader& in) {
  DimensionChoice choice;
  choice.name = text_of(in);
  choice.length = in.number<std::uint64_t>();
  choice.values.resize(in.count(choice_values_max, text_bytes_min));
  for (std::string& value : choice.values) value = text_of(in);
  choice.chosen = text_of(in);
  // A length is a number in JSON.
  if (choice.length > std::size_t{1} << 53 || choice.values.empty() ||
      choice.values.size() > choice.length) {
    in.fail();
  }
  return choice;
}

void put_choice(Writer& out, const DimensionChoice& choice) {
  out.text(choice.name);
  out.number(static_cast<std::uint64_t>(choice.length));
  put_texts(out, choice.values);
  out.text(choice.chosen);
}

void put_axis(Writer& out, const Axis& axis) {
  out.text(axis.name);
  out.text(axis.standard_name);
  out.text(axis.units);
  out.number(static_cast<std::uint8_t>(axis.kind));
  out.doubles(axis.coordinates);
}

void put_field(Writer& out, const FieldInfo& field) {
  out.text(field.name);
  out.number(static_cast<std::uint8_t>(field.kind == FieldKind::scalar ? 0 : 1));
  put_texts(out, field.components);
  out.text(field.units);
  put_texts(out, field.component_units);
  out.text(field.standard_name);
  out.text(field.long_name);
  out.text(field.dtype);
  out.number(static_cast<std::uint8_t>(field.derived ? 1 : 0));
  out.number(field.decoded_bytes);
  out.number(field.chunk_bytes);
  for (std::size_t a = 0; a < 3; ++a) {
    out.number(static_cast<std::int32_t>(field.box_chunk.at(a)));
    out.number(static_cast<std::int32_t>(field.box_chunk_first.at(a)));
  }
}

std::shared_ptr<const StoredLevels> stored_of(Reader& in, const DatasetInfo& info) {
  StoredLevels stored;
  stored.levels.resize(in.count(stored_levels_max, 3 * sizeof(std::int32_t)));
  for (auto& level : stored.levels) {
    for (int& h : level) h = in.number<std::int32_t>();
  }
  for (std::size_t a = 0; a < 3; ++a) {
    stored.widths.at(a) = in.doubles(info.grid.axes.at(a).coordinates.size());
  }
  stored.bytes.resize(in.count(stored_levels_max, sizeof(std::uint64_t)));
  for (std::uint64_t& bytes : stored.bytes) bytes = in.number<std::uint64_t>();
  stored.fields.resize(in.count(info.fields.size(), text_bytes_min));
  for (StoredField& field : stored.fields) {
    const auto has_levels = in.number<std::uint8_t>();
    if (has_levels > 1) in.fail();
    field.has_levels = has_levels == 1;
    field.strided = in.number<std::int32_t>();
    constexpr std::size_t each = 2 * sizeof(float) + sizeof(std::int64_t);
    field.ranges.resize(in.count(info.steps.size(), each));
    for (StoredRange& range : field.ranges) {
      for (float& end : range.range) end = in.number<float>();
      range.masked = in.number<std::int64_t>();
    }
  }
  if (!in.sound() || !fault_of(stored, info).empty()) {
    in.fail();
    return nullptr;
  }
  return std::make_shared<const StoredLevels>(std::move(stored));
}

void put_stored(Writer& out, const StoredLevels& stored) {
  out.count(stored.levels.size());
  for (const auto& level : stored.levels) {
    for (const int h : level) out.number(static_cast<std::int32_t>(h));
  }
  for (const auto& widths : stored.widths) out.doubles(widths);
  out.count(stored.bytes.size());
  for (const std::uint64_t bytes : stored.bytes) out.number(bytes);
  out.count(stored.fields.size());
  for (const StoredField& field : stored.fields) {
    out.number(static_cast<std::uint8_t>(field.has_levels ? 1 : 0));
    out.number(static_cast<std::int32_t>(field.strided));
    out.count(field.ranges.size());
    for (const StoredRange& range : field.ranges) {
      for (const float end : range.range) out.number(end);
      out.number(range.masked);
    }
  }
}

Error malformed(const char* what) {
  return make_error(ErrorKind::bad_data, std::string("the loader sent ") + what);
}

}  // namespace

std::string encode_task(const Task& task) {
  Writer out;
  out.number(task.memory_bytes);
  put_texts(out, task.library_folders);
  out.number(static_cast<std::uint8_t>(task.location.kind));
  out.number(static_cast<std::uint8_t>(task.location.companions ? 1 : 0));
  out.number(static_cast<std::uint8_t>(task.location.fetched ? 1 : 0));
  out.number(static_cast<std::uint8_t>(task.location.service ? 1 : 0));
  out.text(task.location.stem);
  out.text(task.location.inside);
  out.text(task.location.pattern);
  out.text(task.location.list);
  out.count(task.location.selection.size());
  for (const SelectedEntry& one : task.location.selection) {
    out.text(one.dimension);
    out.text(one.value);
  }
  out.count(task.location.members.size());
  for (const Location::Member& member : task.location.members) out.text(member.name);
  return out.bytes();
}

Result<Task> decode_task(std::string_view bytes) {
  Reader in(bytes);
  Task out;
  out.memory_bytes = in.number<std::uint64_t>();
  out.library_folders.resize(in.count(things_max, text_bytes_min));
  for (std::string& folder : out.library_folders) folder = in.text(text_max);
  const auto kind = in.number<std::uint8_t>();
  if (kind > static_cast<std::uint8_t>(Location::Kind::folder)) in.fail();
  out.location.kind = static_cast<Location::Kind>(kind);
  out.location.companions = in.number<std::uint8_t>() != 0;
  out.location.fetched = in.number<std::uint8_t>() != 0;
  out.location.service = in.number<std::uint8_t>() != 0;
  out.location.stem = in.text(text_max);
  out.location.inside = in.text(text_max);
  out.location.pattern = in.text(text_max);
  out.location.list = in.text(text_max);
  out.location.selection.resize(in.count(selection_max, 2 * text_bytes_min));
  for (SelectedEntry& one : out.location.selection) {
    one.dimension = in.text(text_max);
    one.value = in.text(text_max);
  }
  out.location.members.resize(in.count(things_max, text_bytes_min));
  for (Location::Member& member : out.location.members) member.name = in.text(text_max);
  if (!in.complete()) return make_error(ErrorKind::internal, "the task of the loader is malformed");
  return out;
}

std::string encode_wanted(const Wanted& wanted) {
  Writer out;
  out.number(wanted.field);
  out.number(wanted.step);
  out.number(static_cast<std::uint64_t>(wanted.part.level));
  out.number(static_cast<std::uint8_t>(wanted.part.as));
  for (const auto& three : {wanted.part.box.first, wanted.part.box.count}) {
    for (const int n : three) out.number(static_cast<std::int32_t>(n));
  }
  out.number(wanted.window_layers);
  out.number(static_cast<std::uint8_t>(wanted.keeps_memory ? 1 : 0));
  return out.take();
}

Result<Wanted> decode_wanted(std::string_view bytes, const DatasetInfo& info) {
  Reader in(bytes);
  Wanted out;
  out.field = in.number<std::uint64_t>();
  out.step = in.number<std::uint64_t>();
  out.part.level = in.number<std::uint64_t>();
  const auto as = in.number<std::uint8_t>();
  if (as > static_cast<std::uint8_t>(StoredAs::strided)) in.fail();
  out.part.as = static_cast<StoredAs>(in.sound() ? as : 0);
  for (auto* three : {&out.part.box.first, &out.part.box.count}) {
    for (int& n : *three) n = in.number<std::int32_t>();
  }
  out.window_layers = in.number<std::uint64_t>();
  out.keeps_memory = in.number<std::uint8_t>() != 0;
  const bool is_whole = out.part == StoredPart{whole_box(info.grid.dims())};
  if (in.complete() && out.field < info.fields.size() && out.step < info.steps.size() &&
      (is_whole || (out.window_layers == 0 && is_stored(info, out.field, out.part)))) {
    return out;
  }
  return make_error(ErrorKind::internal, "no such field, step or box");
}

std::string encode_error(const Error& error) {
  Writer out;
  out.number(static_cast<std::uint8_t>(error.kind));
  out.text(std::string_view(error.message).substr(0, text_max));
  return out.bytes();
}

Error decode_error(std::string_view bytes) {
  Reader in(bytes);
  const auto number = in.number<std::uint8_t>();
  std::string message = printable(in.text(text_max), 4000);
  const auto is = [number](ErrorKind kind) { return number == static_cast<std::uint8_t>(kind); };
  if (!in.complete() || message.empty()) return malformed("a malformed error");
  for (const ErrorKind kind : {ErrorKind::not_found, ErrorKind::out_of_memory, ErrorKind::internal,
                               ErrorKind::too_large}) {
    if (is(kind)) return make_error(kind, std::move(message));
  }
  return make_error(ErrorKind::bad_data, std::move(message));
}

std::string encode_info(const DatasetInfo& info) {
  Writer out;
  for (const auto* text : {&info.id, &info.title, &info.source, &info.format, &info.digest,
                           &info.time_units, &info.time_calendar}) {
    out.text(*text);
  }
  for (const Axis& axis : info.grid.axes) put_axis(out, axis);
  out.count(info.fields.size());
  for (const FieldInfo& field : info.fields) put_field(out, field);
  out.count(info.left_out.size());
  for (const LeftOut& left : info.left_out) {
    out.text(left.name);
    out.text(left.reason);
  }
  put_texts(out, info.notes);
  out.count(info.choices.size());
  for (const DimensionChoice& choice : info.choices) put_choice(out, choice);
  out.count(info.steps.size());
  for (const TimeStep& step : info.steps) {
    out.number(step.value);
    out.text(step.text);
  }
  out.number(static_cast<std::uint8_t>(info.stored ? 1 : 0));
  if (info.stored) put_stored(out, *info.stored);
  // The largest parts by far come last, so that the message is reallocated only once.
  const Columns none;
  const Columns& columns = info.grid.columns ? *info.grid.columns : none;
  const std::size_t heights = info.grid.ground ? info.grid.ground->heights.size() : 0;
  constexpr std::size_t beside = 1024;  // flags, counts and a name
  out.reserve((columns.longitude.size() + columns.latitude.size()) * sizeof(double) +
              heights * sizeof(float) + beside);
  out.number(static_cast<std::uint8_t>(info.grid.columns ? 1 : 0));
  if (info.grid.columns) {
    out.doubles(columns.longitude);
    out.doubles(columns.latitude);
  }
  out.number(static_cast<std::uint8_t>(info.grid.ground ? 1 : 0));
  if (info.grid.ground) {
    out.text(info.grid.ground->name);
    out.number(static_cast<std::uint8_t>(info.grid.ground->kind));
    out.numbers(info.grid.ground->heights);
  }
  return out.take();
}

Result<DatasetInfo> decode_info(std::string_view bytes) {
  Reader in(bytes);
  DatasetInfo info;
  for (auto* text : {&info.id, &info.title, &info.source, &info.format, &info.digest,
                     &info.time_units, &info.time_calendar}) {
    *text = text_of(in);
  }
  info.grid = grid_of(in);
  const std::uint64_t samples = in.sound() ? info.grid.samples() : 0;
  info.fields.resize(in.count(things_max, text_bytes_min));
  for (FieldInfo& field : info.fields) {
    field = field_of(in, info.grid.dims(), samples);
    if (!in.sound()) break;
  }
  info.left_out.resize(in.count(things_max, 2 * text_bytes_min));
  for (LeftOut& left : info.left_out) {
    left.name = text_of(in);
    left.reason = text_of(in);
  }
  info.notes = texts_of(in);
  info.choices.resize(in.count(choices_max, 3 * text_bytes_min));
  for (DimensionChoice& choice : info.choices) choice = choice_of(in);
  info.steps.resize(in.count(steps_max, sizeof(double) + text_bytes_min));
  for (TimeStep& step : info.steps) {
    step.value = in.number<double>();
    step.text = text_of(in);
    if (!std::isfinite(step.value)) in.fail();
  }
  const auto follows = [&in] {
    const auto flag = in.number<std::uint8_t>();
    if (flag > 1) in.fail();
    return in.sound() && flag == 1;
  };
  if (follows()) info.stored = stored_of(in, info);
  const std::size_t layer =
      info.grid.axes[0].coordinates.size() * info.grid.axes[1].coordinates.size();
  if (follows()) info.grid.columns = columns_of(in, layer);
  if (follows()) info.grid.ground = ground_of(in, layer);
  if (!in.complete()) return malformed("a malformed description");
  if (info.fields.empty() || info.steps.empty()) return malformed("a dataset without data");
  return info;
}

std::string encode_parts(const FileParts& parts) {
  if (parts.number == 0 && parts.state.empty()) return {};
  Writer out;
  out.number(parts.number);
  out.text(parts.state);
  return out.take();
}

Result<FileParts> decode_parts(std::string_view bytes) {
  constexpr std::size_t state_bytes_max = 1024;
  FileParts out;
  if (bytes.empty()) return out;
  Reader in(bytes);
  out.number = in.number<std::uint64_t>();
  out.state = in.text(state_bytes_max);
  if (in.complete()) return out;
  return make_error(ErrorKind::internal, "an answer of the daemon is malformed");
}

std::string encode_expected(const Expected& expected) {
  Writer out;
  out.text(expected.name);
  out.number(static_cast<std::uint8_t>(expected.in_parts ? 1 : 0));
  out.number(expected.tail_bytes);
  out.count(expected.extents.size());
  for (const Extent& one : expected.extents) {
    out.number(one.begin);
    out.number(one.end);
  }
  return out.take();
}

Result<Expected> decode_expected(std::string_view bytes) {
  Reader in(bytes);
  Expected out;
  out.name = in.text(question_bytes_max);
  out.in_parts = in.number<std::uint8_t>() != 0;
  out.tail_bytes = in.number<std::uint64_t>();
  out.extents.resize(in.count(expected_extents_max, sizeof(Extent)));
  for (Extent& one : out.extents) {
    one.begin = in.number<std::uint64_t>();
    one.end = in.number<std::uint64_t>();
  }
  if (in.complete()) return out;
  return make_error(ErrorKind::internal, "what is expected is malformed");
}

std::string encode_names(const std::vector<std::string>& names) {
  Writer out;
  put_texts(out, names);
  return out.bytes();
}

Result<std::vector<std::string>> decode_names(std::string_view bytes) {
  Reader in(bytes);
  std::vector<std::string> out(in.count(things_max + 1, text_bytes_min));
  for (std::string& name : out) name = in.text(text_max);
  if (!in.complete()) return make_error(ErrorKind::internal, "a folder's list is malformed");
  return out;
}

}  // namespace windsplat::data::loader
