// Words of the texts of DAP2 (DDS, DAS), which are nested lists in braces.
#pragma once

#include <string>
#include <string_view>

namespace windsplat::data::dap {

// Deeper texts are malformed.
inline constexpr int depth_max = 8;

struct Word {
  enum class Kind { none, name, quoted, mark };  // none: the text has ended
  Kind kind = Kind::none;
  std::string text;  // without quotes and escapes; a mark is one of {}[];,=:

  [[nodiscard]] bool is(char mark) const {
    return kind == Kind::mark && text.size() == 1 && text[0] == mark;
  }
  // Ignores case, as keywords do.
  [[nodiscard]] bool is_name(std::string_view name) const;
};

class Words {
 public:
  explicit Words(std::string_view text) : rest_(text) { next(); }
  // The word that comes next.
  [[nodiscard]] const Word& peek() const { return word_; }
  Word take();
  // Takes the mark if it comes next.
  bool take(char mark);
  // Takes everything up to the end of a declaration, with the blocks in it.
  bool skip();

 private:
  void next();
  std::string_view rest_;
  Word word_;
};

}  // namespace windsplat::data::dap
