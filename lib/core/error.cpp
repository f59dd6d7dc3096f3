#include "lib/core/error.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace pileus {
namespace {

std::string join_lines(const std::vector<Diagnostic>& diagnostics) {
  std::string text;
  for (const Diagnostic& diagnostic : diagnostics) {
    if (!text.empty()) text += '\n';
    text += to_string(diagnostic);
  }
  return text;
}

/// Optimal string alignment distance: insertions, deletions, substitutions and swaps of neighbours cost 1.
size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<size_t> before(b.size() + 1), previous(b.size() + 1), current(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) previous[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t substitution = previous[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      current[j] = std::min({previous[j] + 1, current[j - 1] + 1, substitution});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) current[j] = std::min(current[j], before[j - 2] + 1);
    }
    std::swap(before, previous);
    std::swap(previous, current);
  }
  return previous[b.size()];
}

}  // namespace

Error::Error(ErrorKind kind, std::vector<Diagnostic> diagnostics)
    : std::runtime_error(join_lines(diagnostics)), m_kind(kind), m_diagnostics(std::move(diagnostics)) {}

Error::Error(ErrorKind kind, SourceLoc loc, std::string message)
    : Error(kind, std::vector<Diagnostic>{{std::move(loc), std::move(message)}}) {}

Error::Error(ErrorKind kind, std::string_view file, std::string message)
    : Error(kind, SourceLoc{std::string(file)}, std::move(message)) {}

std::string to_string(const Diagnostic& diagnostic) {
  const SourceLoc& loc = diagnostic.loc;
  std::string text = loc.file;
  if (loc.line > 0) text += fmt::format(":{}:{}", loc.line, loc.column);
  if (!text.empty()) text += ": ";
  return text + "error: " + diagnostic.message;
}

std::string nearest_name(std::string_view wanted, const std::vector<std::string>& names) {
  // A third of the letters may differ: enough for typing slips, too little to suggest an unrelated name.
  size_t best_distance = std::max<size_t>(1, wanted.size() / 3) + 1;
  std::string best;
  for (const std::string& name : names) {
    const size_t distance = edit_distance(wanted, name);
    if (distance < best_distance) {
      best_distance = distance;
      best = name;
    }
  }
  return best;
}

std::string join_or(const std::vector<std::string>& names) {
  std::string text;
  for (size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " or " : ", ";
    text += names[i];
  }
  return text;
}

void check_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: internal error: %s does not hold; please report this\n", file, line,
               condition);
  std::abort();
}

}  // namespace pileus
