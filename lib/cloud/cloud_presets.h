#pragma once

#include <string>
#include <vector>

#include "lib/cloud/cloud_recipe.h"
#include "lib/freeform/free_form.h"
#include "lib/math/vec.h"

namespace pileus {

/// "cumulus", "stratus", … in the order of the manual.
std::vector<std::string> cloud_preset_names();

/// A free form for a kind of cloud, filling a box of the given centre and size [m].
FreeForm cloud_preset_form(const std::string& name, const Vec3d& center, const Vec3d& size);

/// The recipe of a kind of cloud; `name` is one of cloud_preset_names().
CloudRecipe cloud_preset(const std::string& name);

}  // namespace pileus
