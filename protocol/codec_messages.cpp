// Text messages of the stream: client JSON -> ClientMessage, ServerMessage -> JSON.
#include <cmath>
#include <limits>

#include "protocol/codec.hpp"
#include "protocol/codec_json.hpp"
#include "protocol/codec_shapes.hpp"
#include "protocol/limits.hpp"
#include "server/base/check.hpp"

namespace windsplat::protocol {

namespace {

constexpr IntegerRange serial{0, limits::serial_max};
constexpr IntegerRange step_range{0, limits::step_max};
constexpr IntegerRange edge_range{1, limits::image_edge_max};

enum class ClientKind { open, patch, still, play, pause, ack, visibility, video };

constexpr std::array<Name<ClientKind>, 8> client_names{{{ClientKind::open, "open"},
                                                        {ClientKind::patch, "patch"},
                                                        {ClientKind::still, "still"},
                                                        {ClientKind::play, "play"},
                                                        {ClientKind::pause, "pause"},
                                                        {ClientKind::ack, "ack"},
                                                        {ClientKind::visibility, "visibility"},
                                                        {ClientKind::video, "video"}}};
constexpr std::array<Name<bool>, 2> format_names{{{true, "png"}, {false, "jpeg"}}};

OpenMessage read_open(ObjectReader& reader) {
  OpenMessage message;
  reader.integer("id", message.id, serial, Presence::required);
  reader.text("dataset", message.dataset, 1, Presence::required);
  return message;
}

PatchMessage read_patch(ObjectReader& reader) {
  PatchMessage message;
  reader.integer("rev", message.rev, serial, Presence::required);
  constexpr double any = std::numeric_limits<double>::max();
  reader.number("t", message.t, {-any, any});
  if (const Json* patch = reader.child("patch", Presence::required)) {
    if (patch->is_object()) {
      message.patch_json = dump(*patch);
    } else {
      reader.faults().add(reader.at("patch"), "must be an object, not " + described(*patch));
    }
  }
  return message;
}

void check_still(const StillMessage& message, ObjectReader& reader) {
  const auto check_edge = [&](const char* key, const std::optional<int>& edge) {
    if (edge && std::ceil(*edge * message.scale) > limits::image_edge_max) {
      reader.faults().add(
          reader.at(key),
          "times scale must be at most " + std::to_string(limits::image_edge_max) + " pixels",
          ErrorKind::too_large);
      return false;
    }
    return true;
  };
  const bool edges_fit = check_edge("width", message.width) && check_edge("height", message.height);
  if (!edges_fit || !message.width || !message.height) return;
  const double pixels =
      std::ceil(*message.width * message.scale) * std::ceil(*message.height * message.scale);
  if (pixels > static_cast<double>(limits::image_pixels_max)) {
    reader.faults().add(reader.pointer(),
                        "requests " + dump(canonical_number(pixels)) + " pixels; the limit is " +
                            std::to_string(limits::image_pixels_max),
                        ErrorKind::too_large);
  }
}

StillMessage read_still(ObjectReader& reader) {
  StillMessage message;
  reader.integer("id", message.id, serial, Presence::required);
  reader.integer("width", message.width, edge_range);
  reader.integer("height", message.height, edge_range);
  bool png = true;
  reader.choice("format", png, format_names);
  message.format = png ? "png" : "jpeg";
  reader.number("scale", message.scale, {1, limits::still_scale_max});
  check_still(message, reader);
  return message;
}

PlayMessage read_play(ObjectReader& reader) {
  PlayMessage message;
  reader.integer("from", message.from, step_range, Presence::required);
  reader.integer("to", message.to, step_range, Presence::required);
  reader.number("fps", message.fps, {limits::fps_min, limits::fps_max});
  reader.boolean("loop", message.loop);
  reader.boolean("drop", message.drop);
  return message;
}

AckMessage read_ack(ObjectReader& reader) {
  AckMessage message;
  reader.integer("seq", message.seq, {1, limits::serial_max}, Presence::required);
  reader.number("decodeMs", message.decode_ms, {0, limits::decode_ms_max});
  return message;
}

VisibilityMessage read_visibility(ObjectReader& reader) {
  VisibilityMessage message;
  reader.boolean("hidden", message.hidden, Presence::required);
  return message;
}

VideoMessage read_video(ObjectReader& reader) {
  VideoMessage message;
  const Json* codecs = reader.child("codecs", Presence::required);
  if (codecs == nullptr) return message;
  const std::string pointer = reader.at("codecs");
  if (!codecs->is_array()) {
    reader.faults().add(pointer, "must be an array, not " + described(*codecs));
    return message;
  }
  if (codecs->size() > limits::video_codecs_max) {
    reader.faults().add(pointer, "must have at most " + std::to_string(limits::video_codecs_max) +
                                     " entries, not " + std::to_string(codecs->size()));
    return message;
  }
  for (std::size_t n = 0; n < codecs->size(); ++n) {
    auto codec = reader.read_text((*codecs)[n], pointer + "/" + std::to_string(n), 1);
    if (codec) message.codecs.push_back(std::move(*codec));
  }
  return message;
}

ClientMessage read_body(ClientKind kind, ObjectReader& reader) {
  switch (kind) {
    case ClientKind::open:
      return read_open(reader);
    case ClientKind::patch:
      return read_patch(reader);
    case ClientKind::still:
      return read_still(reader);
    case ClientKind::play:
      return read_play(reader);
    case ClientKind::pause:
      return PauseMessage{};
    case ClientKind::ack:
      return read_ack(reader);
    case ClientKind::visibility:
      return read_visibility(reader);
    case ClientKind::video:
      return read_video(reader);
  }
  return PauseMessage{};
}

// --- server to client ---------------------------------------------------------------------------

template <class T>
Json value_or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json to_json(const HelloMessage& message) {
  Json datasets = Json::array();
  for (const auto& dataset : message.datasets) datasets.push_back(dataset_summary_json(dataset));
  return Json{{"type", "hello"},
              {"protocol", protocol_name},
              {"version", message.version},
              {"session", message.session},
              {"limits", limits_json(message.limits)},
              {"datasets", std::move(datasets)}};
}

Json to_json(const OpenedMessage& message) {
  return Json{{"type", "opened"}, {"id", message.id}, {"dataset", dataset_json(message.dataset)}};
}

Json to_json(const ProgressMessage& message) {
  return Json{{"type", "progress"},
              {"id", value_or_null(message.id)},
              {"phase", message.phase},
              {"done", canonical_number(message.done)},
              {"etaMs", message.eta_ms ? canonical_number(*message.eta_ms) : Json(nullptr)}};
}

Json to_json(const ChosenMessage& message) {
  Json out = frame_info_json(message.info);
  out["type"] = "chosen";
  out["seq"] = message.seq;
  auto view = parse_json(message.view_json);
  WINDSPLAT_CHECK(view.has_value());  // text made by the server itself
  out["view"] = std::move(*view);
  return out;
}

Json to_json(const UnchangedMessage& message) {
  return Json{{"type", "unchanged"}, {"rev", message.rev}, {"seq", message.seq}};
}

Json to_json(const StatsMessage& message) {
  return Json{{"type", "stats"},
              {"frames", message.frames},
              {"dropped", message.dropped},
              {"cancelled", message.cancelled},
              {"bytes", message.bytes},
              {"playFps", message.play_fps ? canonical_number(*message.play_fps) : Json(nullptr)},
              {"stepsDropped", message.steps_dropped},
              {"stepsNotReady", message.steps_not_ready}};
}

Json to_json(const ErrorMessage& message) {
  Json out{{"type", "error"}, {"problem", problem_json(message.problem)}};
  if (message.id) out["id"] = *message.id;
  if (message.rev) out["rev"] = *message.rev;
  return out;
}

}  // namespace

Result<ClientMessage> parse_client_message(std::string_view json) {
  const auto tree = parse_json(json);
  if (!tree) return tree.error();
  Faults faults;
  ObjectReader reader(*tree, "", faults);
  ClientKind kind = ClientKind::pause;
  if (reader.child("type", Presence::required) != nullptr) {
    reader.choice("type", kind, client_names);
  }
  // The meaning of the other keys depends on the type.
  if (!faults.empty()) return faults.error();
  ClientMessage message = read_body(kind, reader);
  reader.finish();
  if (!faults.empty()) return faults.error();
  return message;
}

MessageTag message_tag(std::string_view json) {
  MessageTag tag;
  const auto tree = parse_json(json);
  if (!tree || !tree->is_object()) return tag;
  Faults ignored;
  ObjectReader reader(*tree, "", ignored);
  reader.integer("id", tag.id, serial);
  reader.integer("rev", tag.rev, serial);
  return tag;
}

// The keys are in the order of all other messages.
std::string opened_with(const std::string& dataset, std::uint32_t id) {
  std::string text = R"({"dataset":)";
  text.reserve(dataset.size() + 64);
  text += dataset;
  text += R"(,"id":)";
  text += std::to_string(id);
  text += R"(,"type":"opened"})";
  return text;
}

std::string encode(const ServerMessage& message) {
  const auto* const opened = std::get_if<OpenedMessage>(&message);
  if (opened != nullptr && opened->dataset.encoded != nullptr) {
    return opened_with(*opened->dataset.encoded, opened->id);
  }
  return dump(std::visit([](const auto& body) { return to_json(body); }, message));
}

}  // namespace windsplat::protocol
