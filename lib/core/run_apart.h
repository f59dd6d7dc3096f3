#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace pileus {

struct ApartLimits {
  double seconds;  ///< of processor time
  uint64_t bytes;  ///< of memory beyond what this process has
};

/// Runs body in a copy of this process and returns what it returns; nothing where the copy crashed, took too
/// long or too much. For libraries that damaged input leads astray. What body changes stays in the copy; it
/// must not use other threads nor wait for them. errors: Error(failed) where no process can be started
std::optional<std::string> run_apart(const std::function<std::string()>& body, const ApartLimits& limits);

}  // namespace pileus
