#pragma once

#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "lib/core/error.h"

namespace pileus {

/// Calls body; an error that it throws gets the name of what it is about: `volume "plume": ...`.
template <class Body>
auto named_errors(const char* kind, const std::string& name, Body&& body) {
  try {
    return body();
  } catch (const Error& error) {
    if (error.kind() == ErrorKind::cancelled) throw;
    std::vector<Diagnostic> diagnostics = error.diagnostics();
    for (Diagnostic& diagnostic : diagnostics) {
      diagnostic.message = fmt::format("{} \"{}\": {}", kind, name, diagnostic.message);
    }
    throw Error(error.kind(), std::move(diagnostics));
  }
}

}  // namespace pileus
