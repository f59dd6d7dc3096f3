#include "lib/scene/key_depth.h"

#include <algorithm>

#include "lib/core/error.h"

namespace pileus {
namespace {

/// The last character of the string that starts at `begin`. An unclosed one is left to the parser.
size_t end_of_string(std::string_view text, size_t begin) {
  const char quote = text[begin];
  const bool is_long = text.substr(begin, 3) == std::string(3, quote);
  const std::string closing(is_long ? 3 : 1, quote);
  for (size_t i = begin + closing.size(); i < text.size(); ++i) {
    if (quote == '"' && text[i] == '\\') {
      ++i;
    } else if (!is_long && text[i] == '\n') {
      return i;
    } else if (text.substr(i, closing.size()) == closing) {
      i += closing.size() - 1;
      // A long string may end in quotes of its own.
      for (int n = 0; is_long && n < 2 && text.substr(i + 1, 1) == std::string_view(&quote, 1); ++n) ++i;
      return i;
    }
  }
  return text.size();
}

}  // namespace

void check_key_depth(std::string_view text, const std::string& name) {
  size_t dots = 0;  // since the key began; numbers have at most one
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '"' || c == '\'') {
      i = end_of_string(text, i);
    } else if (c == '#') {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (std::string_view("\n=,{}[]").find(c) != std::string_view::npos) {
      dots = 0;
    } else if (c == '.' && ++dots >= kMaxKeyParts) {
      const std::string_view before = text.substr(0, i);
      const size_t line_begin = before.rfind('\n') + 1;  // 0 on the first line: npos + 1
      throw Error(
          ErrorKind::scene,
          SourceLoc{name, int(std::count(before.begin(), before.end(), '\n')) + 1, int(i - line_begin) + 1},
          fmt::format("a key has more than {} parts", kMaxKeyParts));
    }
  }
}

}  // namespace pileus
