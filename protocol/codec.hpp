// JSON in and out: the only place that knows the JSON library. Everything past it is typed.
// Every parser refuses: over-long text, nesting beyond the limit, duplicate and unknown keys,
// invalid UTF-8, numbers out of range or not finite; each with its JSON pointer.
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

// A view as the user wrote it: any subset of its keys, already validated. Kept as text so that
// what was said, and not what was defaulted, is what patches apply to.
class ViewDocument {
 public:
  ViewDocument() : json_("{}") {}

  static Result<ViewDocument> parse(std::string_view json);

  // RFC 7396, with one exception that the schema's nullable keys need: null at /vector/field is
  // kept as a value ("draw no lines"). Elsewhere null removes a key, which brings its default back.
  [[nodiscard]] Result<ViewDocument> patched(std::string_view patch_json) const;

  // The typed view; absent keys take the schema's defaults.
  [[nodiscard]] View view() const;

  [[nodiscard]] const std::string& canonical() const { return json_; }  // keys sorted, no spaces

 private:
  std::string json_;
};

// render --set /pointer=value: the value is JSON, or a plain string where it does not parse.
Result<ViewDocument> set_at(const ViewDocument& document, std::string_view pointer,
                            std::string_view value);

// Several of them, (pointer, value) in order; only what they make together is checked.
Result<ViewDocument> set_all(const ViewDocument& document,
                             const std::vector<std::pair<std::string, std::string>>& changes);

std::string encode_view(const View& view);  // every key; canonical

Result<ClientMessage> parse_client_message(std::string_view json);

// What an ErrorMessage should name when parse_client_message refused: the id and rev that the
// message bears, as far as they can be read.
struct MessageTag {
  std::optional<std::uint32_t> id;
  std::optional<std::uint32_t> rev;
};
MessageTag message_tag(std::string_view json);

std::string encode(const ServerMessage& message);

std::string encode_problem(const Problem& problem);                                // RFC 9457
std::string encode_dataset(const DatasetDescription& dataset);                     // the long form
std::string encode_dataset_list(const std::vector<DatasetDescription>& datasets);  // short forms
std::string encode_frame_info(const FrameInfo& info);  // Windsplat-Frame
// render --report: the same with renderMs and encodeMs.
std::string encode_frame_report(const FrameInfo& info, double render_ms, double encode_ms);
std::string encode_service(const ServiceDescription& service);  // GET /v1
std::string encode_color_maps(const std::vector<ColorMapDescription>& maps);
std::string encode_presets(const std::vector<std::string>& names);

}  // namespace windsplat::protocol
