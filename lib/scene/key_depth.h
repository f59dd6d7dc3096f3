#pragma once

#include <string>
#include <string_view>

namespace pileus {

/// Most parts of a dotted key, `a.b.c`, in a scene.
inline constexpr size_t kMaxKeyParts = 64;

/// Refuses TOML text with a key of more parts. The parser bounds how deep values nest but not how deep keys
/// do, and a tree of a million levels overflows the stack as soon as it is destroyed. errors: Error(scene) at
/// the key
void check_key_depth(std::string_view text, const std::string& name);

}  // namespace pileus
