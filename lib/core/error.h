#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace pileus {

/// A place in a text file. Lines and columns count from 1; 0 means unknown.
struct SourceLoc {
  std::string file;
  int line = 0;
  int column = 0;
};

/// One complaint: where, and what was found, expected and near.
struct Diagnostic {
  SourceLoc loc;
  std::string message;
};

/// What went wrong, as far as a caller can react to it. The command line turns it into its exit code.
enum class ErrorKind {
  usage,      ///< the call itself is wrong: an unknown option, plugin or value (exit code 2)
  scene,      ///< the scene or recipe is invalid (exit code 2)
  file,       ///< a file cannot be read or written, or is damaged (exit code 1)
  failed,     ///< the work cannot be done as asked (exit code 1)
  cancelled,  ///< the user interrupted (exit code 130)
};

/// The one exception type that pileus throws on purpose. Carries one or more diagnostics; what() is all of
/// them, a line each, as `file:line:column: error: message`.
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, std::vector<Diagnostic> diagnostics);
  Error(ErrorKind kind, SourceLoc loc, std::string message);
  Error(ErrorKind kind, std::string_view file, std::string message);

  ErrorKind kind() const { return m_kind; }
  const std::vector<Diagnostic>& diagnostics() const { return m_diagnostics; }

 private:
  ErrorKind m_kind;
  std::vector<Diagnostic> m_diagnostics;
};

/// `file:line:column: error: message`, leaving out what is unknown.
std::string to_string(const Diagnostic& diagnostic);

/// The name most like `wanted` (by edit distance with transpositions), or "" where nothing is close enough to
/// be worth a hint.
std::string nearest_name(std::string_view wanted, const std::vector<std::string>& names);

/// "a, b or c": the way alternatives read in a message.
std::string join_or(const std::vector<std::string>& names);

[[noreturn]] void check_failed(const char* condition, const char* file, int line);

/// An invariant of the program itself, kept in every build. Bad input never reaches one.
#define PILEUS_CHECK(condition) \
  ((condition) ? void(0) : ::pileus::check_failed(#condition, __FILE__, __LINE__))

}  // namespace pileus
