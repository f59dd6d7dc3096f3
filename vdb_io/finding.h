#pragma once

#include <string>

namespace pileus {

/// How much a finding matters.
enum class Severity {
  note,     ///< worth knowing
  warning,  ///< works, but perhaps not as meant
  error,    ///< the file or the grid cannot be used as it is
};

/// "note", "warning" or "error".
const char* name_of(Severity severity);

/// Something about a file that its user should know, and what to do about it.
struct Finding {
  Severity severity = Severity::note;
  std::string code;     ///< stable, for programs: "nan", "level_set", …
  std::string grid;     ///< "" where the file as a whole is meant
  std::string message;  ///< a sentence that goes on from the grid's name
  std::string fix;    ///< a command line that writes a better file or works round it; "" where there is none
  std::string scene;  ///< a line of a scene's volume that works round it; "" where there is none
};

}  // namespace pileus
