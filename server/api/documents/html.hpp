// Text of HTML elements.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

namespace windsplat::api::documents {

std::string escaped(std::string_view text);
// <name>text</name>, where the text is escaped.
std::string element(std::string_view name, std::string_view text);
// The same of HTML.
std::string element_of(std::string_view name, std::string_view html);
std::string link(std::string_view target, std::string_view text);
// A row of cells of HTML; the first is the head of the row.
std::string table_row(std::initializer_list<std::string> cells);
std::string table(std::string_view caption, std::initializer_list<std::string_view> heads,
                  std::string_view rows);
// Text in which names stand between backquotes.
std::string prose(std::string_view text);
// The same with empty lines between paragraphs.
std::string paragraphs(std::string_view text);

}  // namespace windsplat::api::documents
