// Readable pages of the documents: one HTML file each, without scripts.
#pragma once

#include <string>
#include <string_view>

namespace windsplat::api::documents {

// `document`: the text of openapi() or asyncapi().
std::string openapi_page(std::string_view document);
std::string asyncapi_page(std::string_view document);

// The content of the style element of both, for a hash in the Content-Security-Policy.
std::string_view page_style();

}  // namespace windsplat::api::documents
