#pragma once

#include <string>

#include "integrators/march_scene.h"
#include "lib/core/param_table.h"

namespace pileus {

/// What a scene may ask of `march` besides a tolerance.
struct MarchOptions {
  bool leaping = true;
  bool sun_cache = true;
  bool level_of_detail = false;
  std::string storage = "auto";

  void describe(ParamTable& params) {
    params.boolean("leaping", leaping, "skip empty nodes and adapt steps to what is in a node");
    params.boolean("sun_cache", sun_cache, "take sunlight from a cache where that is accurate enough");
    params.boolean("level_of_detail", level_of_detail,
                   "read grids at coarser levels where the picture is the same");
    params.text("storage", storage, "densities as floats, in 16 bits, or as the tolerance allows")
        .one_of({"auto", "float", "16-bit"});
  }

  /// How densities are stored where they may err by so much.
  MarchStorage storage_for(double allowed) const {
    using Kind = MarchStorage::Kind;
    MarchStorage chosen{Kind::by_error, allowed};
    if (storage == "16-bit") chosen.kind = Kind::quantized;
    if (storage == "float") chosen.kind = Kind::floats;
    if (storage == "auto" && level_of_detail) {
      chosen.kind = Kind::floats;
      chosen.why_floats = "coarser levels are made of them";
    }
    return chosen;
  }
};

}  // namespace pileus
