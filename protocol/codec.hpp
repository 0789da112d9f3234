// Parsers and encoders of all JSON documents; other code uses typed values only. Parsers reject
// oversized text, nesting beyond the limit, duplicate and unknown keys, invalid UTF-8, and numbers
// out of range or not finite, each with its JSON pointer.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/messages.hpp"
#include "protocol/view.hpp"
#include "server/base/error.hpp"

namespace windsplat::protocol {

// A validated view as written by the user, with any subset of keys. Stored as text, so that patches
// apply to the explicit keys only, not to defaults.
class ViewDocument {
 public:
  ViewDocument() : json_("{}") {}

  static Result<ViewDocument> parse(std::string_view json);

  // RFC 7396 with one exception: null at /vector/field is stored as a value ("no lines"). Elsewhere
  // null removes a key, which restores its default.
  [[nodiscard]] Result<ViewDocument> patched(std::string_view patch_json) const;

  // The typed view; absent keys have the defaults of the schema.
  [[nodiscard]] View view() const;

  [[nodiscard]] const std::string& canonical() const { return json_; }  // keys sorted, no spaces

 private:
  std::string json_;
};

// render --set /pointer=value: the value is JSON, or a string if it is not valid JSON.
Result<ViewDocument> set_at(const ViewDocument& document, std::string_view pointer,
                            std::string_view value);

// Several of them, (pointer, value) in order; only the final result is checked.
Result<ViewDocument> set_all(const ViewDocument& document,
                             const std::vector<std::pair<std::string, std::string>>& changes);

std::string encode_view(const View& view);  // every key; canonical

// The view of query parameters. Numbers are copied as text, so that the errors of the parser quote
// them.
std::string view_text(const std::optional<std::string>& step,
                      const std::optional<std::string>& width,
                      const std::optional<std::string>& height);

// Patches that a session applies for its client.
std::string step_patch(int step);
// Shows another dataset: resets what refers to fields, coordinates or places of the last one.
// Picture, quality and annotations stay, except a title of one's own.
std::string dataset_patch(const std::string& dataset);

Result<ClientMessage> parse_client_message(std::string_view json);

// The id and rev of a message that parse_client_message rejected, as far as they can be read.
struct MessageTag {
  std::optional<std::uint32_t> id;
  std::optional<std::uint32_t> rev;
};
MessageTag message_tag(std::string_view json);

std::string encode(const ServerMessage& message);

std::string encode_problem(const Problem& problem);  // RFC 9457
// Adds an id that needs no escaping to an encoded problem.
std::string with_request_id(std::string_view problem_json, std::string_view request_id);
std::string encode_health(std::string_view state);
std::string encode_dataset(const DatasetDescription& dataset);                     // the long form
std::string encode_dataset_list(const std::vector<DatasetDescription>& datasets);  // short forms
std::string encode_frame_info(const FrameInfo& info);  // Windsplat-Frame
// render --report: the same with renderMs and encodeMs.
std::string encode_frame_report(const FrameInfo& info, double render_ms, double encode_ms);
std::string encode_service(const ServiceDescription& service);  // GET /v1
std::string encode_color_maps(const std::vector<ColorMapDescription>& maps);
std::string encode_presets(const std::vector<std::string>& names);

}  // namespace windsplat::protocol
