// The resources behind the router: each answers a GET, frames also a POST. Paths and methods are
// checked before.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/frame/frame.hpp"
#include "server/net/exchange.hpp"
#include "server/net/router.hpp"

namespace windsplat::net {

Response get_service(const Services& services);
Response get_color_maps();
Response get_presets();
Response get_view_schema(const Request& request);
Response get_livez();
Response get_readyz(const Services& services);

Response get_datasets(const Services& services);
void get_dataset(Services& services, const std::string& id, const Request& request, Reply reply);

std::optional<frame::Format> format_of_suffix(std::string_view name);  // "frame.jpg"
void get_frame(Services& services, const std::string& id, frame::Format format,
               const Request& request, Reply reply);
void post_frame(Services& services, const Request& request, Reply reply);

// An embedded file of the page; `path` as in web_assets().
bool has_page(const std::string& path);
Response get_page(const Request& request, const std::string& path);

// A JSON document.
Response json_response(std::string json);
// The same with a strong ETag of its content; 304 where the client has it.
Response tagged_response(const Request& request, std::string_view content_type,
                         std::string_view content);
// 128 bits of digest, quoted.
std::string etag_of(std::string_view text);

}  // namespace windsplat::net
