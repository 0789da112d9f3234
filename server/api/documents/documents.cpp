#include "server/api/documents/documents.hpp"

#include "server/api/documents/asyncapi.hpp"
#include "server/api/documents/page.hpp"

namespace windsplat::api::documents {

const std::string& Documents::made_once(Made& made, const std::function<std::string()>& make) {
  std::call_once(made.once, [&] { made.text = make(); });
  return made.text;
}

const std::string& Documents::text(Kind kind) {
  switch (kind) {
    case Kind::openapi:
      return made_once(openapi_, [&] { return openapi(entries_, about_); });
    case Kind::openapi_page:
      return made_once(openapi_page_, [&] { return openapi_page(text(Kind::openapi)); });
    case Kind::asyncapi:
      return made_once(asyncapi_, [&] { return asyncapi(about_); });
    case Kind::asyncapi_page:
      return made_once(asyncapi_page_, [&] { return asyncapi_page(text(Kind::asyncapi)); });
  }
  return asyncapi_.text;
}

}  // namespace windsplat::api::documents
