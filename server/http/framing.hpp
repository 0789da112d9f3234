// Frames of other sites: the embedded view (`?embed`), and who may show it.
#pragma once

#include <string>
#include <vector>

#include "server/http/exchange.hpp"

namespace windsplat::http {

// Whether the query asks for the embedded view: a parameter `embed`, with any value.
bool asks_embedded(const Request& request);

// Whether a browser loads the request into a frame (Fetch Metadata: Sec-Fetch-Dest).
bool is_in_frame(const Request& request);

// The directive of a content security policy that lets pages of the own origin and of `embedders`
// show a page in a frame; each is a source such as https://site.example.
std::string frame_ancestors(const std::vector<std::string>& embedders);

// Whether the text is such a source: http or https, a host name whose first label may be "*", and
// perhaps a port of 1 to 65535. It becomes a part of a header, so nothing else may be in it.
bool is_embedder(const std::string& text);

}  // namespace windsplat::http
