#pragma once

#include <string>
#include <vector>

namespace pileus {

/// The names under which Houdini, Blender, Mantaflow, EmberGen, Bifrost, Maya, FumeFX and Phoenix write what
/// `name` is: {"density", "smoke", "fog", …} for any of these, in any case of letters. `name` alone where it
/// is none of them.
std::vector<std::string> aliases_of(const std::string& name);

/// True where both names mean the same: equal but for case, or aliases of each other.
bool means_the_same(const std::string& a, const std::string& b);

}  // namespace pileus
