#pragma once

#include <set>
#include <string>
#include <vector>

namespace pileus {

/// One file of the project, by its path from the root.
struct SourceFile {
  std::string path;
  std::string text;
};

/// What in a file breaks the project's rules, each as "path:line: what was found; what is allowed":
///   - a folder includes only what lies below it, and third-party libraries only where they belong;
///   - public headers show no library but fmt and Imath (`private_headers` are the exceptions);
///   - no 1 - exp(x) and the like, which lose digits where expm1 and log1p do not;
///   - the library neither prints nor exits; nothing is left unfinished, or tied to one machine.
std::vector<std::string> broken_rules(const SourceFile& file, const std::set<std::string>& private_headers);

/// The text of C++ code with comments, strings and characters blanked out. Lines stay where they are, and
/// preprocessor lines as they are.
std::string code_only(const std::string& text);

}  // namespace pileus
