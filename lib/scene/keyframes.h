#pragma once

#include <string>
#include <vector>

#include <toml++/toml.h>

#include "lib/core/error.h"

namespace pileus {

/// Puts the values that belong to a frame in the place of all keyframes of a scene. A keyframed value is a
/// table
///   { times = [1, 48], values = [0.2, 0.5], interpolation = "smooth" }
/// with times in frames, rising, and a value for each: numbers, or arrays (of arrays) of numbers of one
/// shape. Before the first and after the last time the values stay; in between they are interpolated,
/// "linear" (where nothing is said) or "smooth": by a cubic that has no jumps of speed, rests at the ends and
/// where the values turn, and never leaves the values of the two keys around it. What stands there afterwards
/// has the position of the table's first value, for messages. returns: what is wrong with keyframes; those
/// are left as they were. `file` names the text that was parsed.
std::vector<Diagnostic> resolve_keyframes(toml::table& root, double frame, const std::string& file);

}  // namespace pileus
