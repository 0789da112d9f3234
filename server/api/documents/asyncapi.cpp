#include "server/api/documents/asyncapi.hpp"

#include <utility>

#include "protocol/frame_header.hpp"
#include "server/api/documents/bundle.hpp"

namespace windsplat::api::documents {
namespace {

constexpr const char* stream_introduction =
    "The WebSocket of frames, subprotocol windsplat.v1. Text messages are JSON with the key "
    "`type`; "
    "binary messages are frames. A client that cannot set headers also offers the subprotocol "
    "`bearer.` followed by the token in base64url without padding. Within windsplat.v1 only keys "
    "and messages of the server are added: clients ignore those that they do not know.";

// clientMessage, serverMessage: each a list of references.
std::vector<std::string> messages_in(const Json& schema, const char* list) {
  std::vector<std::string> out;
  for (const Json& one : schema.at("$defs").at(list).at("oneOf")) {
    const std::string reference = one.at("$ref");
    out.push_back(reference.substr(reference.rfind('/') + 1));
  }
  return out;
}

Json header_schema() {
  Json parts = Json::object();
  Json required = Json::array();
  for (const HeaderPart& part : frame_header_parts()) {
    const bool is_float = part.type.starts_with('f');
    parts[std::string(part.name)] = {{"type", is_float ? "number" : "integer"},
                                     {"description", part.summary},
                                     {"x-offset", part.offset},
                                     {"x-encoding", part.type}};
    required.push_back(part.name);
  }
  return {{"title", "FrameHeader"},
          {"description",
           "The first bytes of a frame, little-endian: each value at x-offset as "
           "x-encoding (unsigned integers u8, u16, u32; IEEE 754 f32, f64)."},
          {"type", "object"},
          {"required", std::move(required)},
          {"properties", std::move(parts)}};
}

Json frame_message(Bundle& bundle) {
  return {{"name", "frame"},
          {"title", "Frame"},
          {"summary", "A picture; sent after a `chosen` with the same seq"},
          {"contentType", "application/octet-stream"},
          {"headers", bundle.add("FrameHeader", header_schema())},
          {"payload",
           {{"type", "string"},
            {"format", "binary"},
            {"minLength", protocol::frame_header_bytes},
            {"description", "The headers in " + std::to_string(protocol::frame_header_bytes) +
                                " bytes (x-offset, x-encoding), then the encoded picture."}}}};
}

Json text_message(const std::string& shape, const Json& schemas, Bundle& bundle) {
  const Json& schema = schemas.at("$defs").at(shape);
  return {{"name", shape},
          {"title", schema.at("title")},
          {"summary", schema.at("description")},
          {"contentType", "application/json"},
          {"payload", bundle.refer(shape)}};
}

Json reference(const std::string& place) { return {{"$ref", place}}; }

// action: from the view of the server.
Json operation(const char* action, const char* title, const char* description,
               const std::vector<std::string>& messages) {
  Json list = Json::array();
  for (const std::string& message : messages) {
    list.push_back(reference("#/channels/stream/messages/" + message));
  }
  return {{"action", action},
          {"channel", reference("#/channels/stream")},
          {"title", title},
          {"description", description},
          {"messages", std::move(list)}};
}

// One server whose name only the client knows.
Json servers(const About& about) {
  return {
      {"this",
       {{"host", "{host}"},
        {"protocol", about.with_tls ? "wss" : "ws"},
        {"pathname", about.base_path},
        {"description", "The server that sent this document."},
        {"variables",
         {{"host",
           {{"default", "127.0.0.1:8080"}, {"description", "Name and port of the server."}}}}}}}};
}

}  // namespace

const std::vector<HeaderPart>& frame_header_parts() {
  static const std::vector<HeaderPart> parts{
      {"magic", "u32", 0, "The letters WSPL."},
      {"version", "u8", 4, "1."},
      {"kind", "u8", 5, "1: frame."},
      {"headerBytes", "u16", 6, "Length of this header: the picture begins there."},
      {"seq", "u32", 8, "Number of the frame, from 1."},
      {"rev", "u32", 12, "Revision of the view rendered."},
      {"step", "u32", 16, "Time step."},
      {"flags", "u32", 20,
       "1 final, 2 error measured, 4 error estimated, 8 cached, 16 key frame of H.264."},
      {"width", "u16", 24, "Pixels."},
      {"height", "u16", 26, "Pixels."},
      {"codec", "u8", 28, "1 JPEG, 2 PNG, 3 H.264."},
      {"quality", "u8", 29, "Quality of the encoding."},
      {"method", "u8", 30, "1 kernel, 2 slab, 3 reference."},
      {"level", "u8", 31, "About 1/2^level of the size of the view, or less."},
      {"error", "f32", 32, "Linear RMSE of the picture; NaN: unknown."},
      {"jpegError", "f32", 36, "Linear RMSE of the encoding; NaN: unknown."},
      {"queueUs", "u32", 40, "Microseconds."},
      {"renderUs", "u32", 44, "Microseconds."},
      {"encodeUs", "u32", 48, "Microseconds."},
      {"payloadBytes", "u32", 52, "Bytes of the encoded picture."},
      {"t", "f64", 56, "`t` of the newest patch, repeated."}};
  return parts;
}

std::string asyncapi(const About& about) {
  Bundle bundle(about.messages_schema, about.view_schema);
  const Json schemas = Json::parse(about.messages_schema);
  const auto from_client = messages_in(schemas, "clientMessage");
  auto from_server = messages_in(schemas, "serverMessage");
  Json messages = Json::object();
  for (const auto& list : {from_client, from_server}) {
    for (const std::string& shape : list) messages[shape] = text_message(shape, schemas, bundle);
  }
  messages["frame"] = frame_message(bundle);
  from_server.emplace_back("frame");
  Json of_channel = Json::object();
  for (const auto& [name, message] : messages.items()) {
    of_channel[name] = reference("#/components/messages/" + name);
  }
  const Json document{
      {"asyncapi", "3.0.0"},
      {"info",
       {{"title", "windsplat stream"},
        {"version", about.version},
        {"description", stream_introduction},
        {"license", {{"name", "MIT"}}},
        {"tags", Json::array({{{"name", "stream"}, {"description", "Frames over WebSocket."}}})}}},
      {"defaultContentType", "application/json"},
      {"servers", servers(about)},
      {"channels",
       {{"stream",
         {{"address", "v1/stream"},
          {"title", "Stream"},
          {"description", "One WebSocket: patches of a view to the server, frames to the client."},
          {"messages", std::move(of_channel)},
          {"bindings", {{"ws", {{"method", "GET"}, {"bindingVersion", "0.1.0"}}}}}}}}},
      {"operations",
       {{"receive", operation("receive", "Messages of the client",
                              "Each changes what the server shows or sends.", from_client)},
        {"send", operation("send", "Messages and frames of the server",
                           "`hello` is first; each frame follows a `chosen` of the same seq.",
                           from_server)}}},
      {"components", {{"messages", std::move(messages)}, {"schemas", bundle.schemas()}}}};
  return document.dump();
}

}  // namespace windsplat::api::documents
