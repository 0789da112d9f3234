#include "server/api/documents/html.hpp"

#include <algorithm>

namespace windsplat::api::documents {

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string element_of(std::string_view name, std::string_view html) {
  std::string out = "<";
  out.append(name).append(">").append(html).append("</");
  return out.append(name.substr(0, name.find(' '))).append(">");
}

std::string element(std::string_view name, std::string_view text) {
  return element_of(name, escaped(text));
}

std::string link(std::string_view target, std::string_view text) {
  return element("a href=\"" + escaped(target) + "\"", text);
}

std::string table_row(std::initializer_list<std::string> cells) {
  std::string row;
  for (const std::string& cell : cells) {
    row += element_of(row.empty() ? "th scope=\"row\"" : "td", cell);
  }
  return element_of("tr", row) + "\n";
}

std::string table(std::string_view caption, std::initializer_list<std::string_view> heads,
                  std::string_view rows) {
  std::string head;
  for (const std::string_view text : heads) head += element("th scope=\"col\"", text);
  std::string content =
      element("caption", caption) + "<thead>" + element_of("tr", head) + "</thead>\n<tbody>";
  content.append(rows).append("</tbody>");
  return element_of("table", content) + "\n";
}

std::string prose(std::string_view text) {
  std::string out;
  bool is_name = false;
  while (true) {
    const std::size_t end = std::min(text.find('`'), text.size());
    const std::string_view part = text.substr(0, end);
    out += is_name ? element("code", part) : escaped(part);
    if (end == text.size()) return out;
    text.remove_prefix(end + 1);
    is_name = !is_name;
  }
}

std::string paragraphs(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find("\n\n"), text.size());
    out += element_of("p", prose(text.substr(0, end))) + "\n";
    text.remove_prefix(std::min(end + 2, text.size()));
  }
  return out;
}

}  // namespace windsplat::api::documents
