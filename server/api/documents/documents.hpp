// The documents of a server, each made when it is first asked for. Thread-safe.
#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "server/api/documents/openapi.hpp"

namespace windsplat::api::documents {

enum class Kind { openapi, openapi_page, asyncapi, asyncapi_page };

class Documents {
 public:
  explicit Documents(About about) : about_(std::move(about)) {}

  // The table of routes; once, before the first text().
  void describe(std::vector<Entry> entries) { entries_ = std::move(entries); }

  // JSON, or HTML of a page. Valid as long as this object.
  const std::string& text(Kind kind);

 private:
  struct Made {
    std::once_flag once;
    std::string text;
  };
  const std::string& made_once(Made& made, const std::function<std::string()>& make);

  const About about_;
  std::vector<Entry> entries_;
  Made openapi_;
  Made openapi_page_;
  Made asyncapi_;
  Made asyncapi_page_;
};

}  // namespace windsplat::api::documents
