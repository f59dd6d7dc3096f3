#pragma once

#include <string>
#include <vector>

#include <toml++/toml.h>

#include "lib/core/error.h"

namespace pileus {

/// Puts the values that belong to a frame in the place of all keyframes of a scene. A keyframed value is a
/// table
///   { times = [1, 48], values = [0.2, 0.5] }
/// with times in frames, rising, and a value for each: numbers, or arrays (of arrays) of numbers of one
/// shape. Between two times the values are interpolated linearly, before the first and after the last they
/// stay. What stands there afterwards has the position of the table's first value, for messages. returns:
/// what is wrong with keyframes; those are left as they were. `file` names the text that was parsed.
std::vector<Diagnostic> resolve_keyframes(toml::table& root, double frame, const std::string& file);

}  // namespace pileus
