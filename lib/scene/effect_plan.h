#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "lib/scene/scene.h"

namespace pileus {

/// One thing the renderer can simulate, and whether this scene calls for it.
struct Effect {
  std::string name;
  bool on = false;
  std::string reason;   ///< why it is on or off, as a person would say it
  std::string counter;  ///< the counter of the render report that proves it; "" where there is none
};

/// What a scene calls for. Integrators read the flags once, above their loops: what is off is not computed,
/// not allocated and not branched on per sample.
struct EffectPlan {
  bool media = false;                ///< some volume dims, scatters or glows
  bool several_media = false;        ///< more than one: coefficients add up where they overlap
  bool scattering = false;           ///< lights and a medium that scatters
  bool emission = false;             ///< a medium that glows
  bool anisotropic_phase = false;    ///< a scattering medium whose phase function is not isotropic
  bool multiple_scattering = false;  ///< a lit volume with octaves of scattering
  bool powder = false;               ///< a lit volume that is darker where it is thin towards the light
  bool ambient = false;              ///< a volume that scatters light of a sky around
  bool local_lights = false;         ///< lights whose direction changes along a ray
  bool surfaces = false;             ///< solids to see
  bool reflection = false;           ///< solids that mirror what is around them
  bool refraction = false;           ///< solids that are seen through
  bool textures = false;             ///< solids with colours or opacities that change from place to place
  bool holes = false;                ///< some of them less than opaque
  bool sky_light = false;            ///< solids in the light of the background
  bool sun_disc = false;             ///< suns that are seen themselves
  bool media_shadows = false;        ///< media dim the light on its way
  bool surface_shadows = false;      ///< solids block the light
  bool fog = false;                  ///< fog between the camera and what its rays show
  bool level_of_detail = false;      ///< grids, and an integrator that may read them at coarser levels
  std::set<std::string> aovs;        ///< planes that the picture will have

  /// Rays go on from some surface.
  bool secondary_rays() const { return reflection || refraction || holes; }

  std::vector<Effect> effects;  ///< all of the above with their reasons, in a fixed order
};

/// The planes that a picture can have: what scene.render.aovs may name.
std::vector<std::string> aov_names();

/// Derives the plan. Throws Error(scene) for an unknown name in scene.render.aovs.
EffectPlan plan_effects(const Scene& scene);

}  // namespace pileus
