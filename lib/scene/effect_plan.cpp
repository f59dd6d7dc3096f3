#include "lib/scene/effect_plan.h"

#include <algorithm>
#include <functional>
#include <sstream>

#include "lib/core/error.h"

namespace pileus {
namespace {

bool has_light(const Rgb& rgb) {
  return rgb.x > 0.0 || rgb.y > 0.0 || rgb.z > 0.0;
}

/// Names of the scene's objects that satisfy a condition, as "a, b and 3 more".
template <class Kind>
std::string names_where(const std::vector<Named<Kind>>& objects,
                        const std::function<bool(const Kind&)>& condition) {
  constexpr size_t kShown = 3;
  std::string text;
  size_t count = 0;
  for (const Named<Kind>& object : objects) {
    if (!condition(*object.object)) continue;
    if (++count <= kShown) text += (text.empty() ? "" : ", ") + object.name;
  }
  if (count > kShown) text += fmt::format(" and {} more", count - kShown);
  return text;
}

struct AovInfo {
  const char* name;
  const char* meaning;
};

constexpr AovInfo kAovs[] = {
    {"beauty", "radiance and alpha (R, G, B, A)"},
    {"transmittance", "share of the background that shows"},
    {"Z", "distance to the first medium or surface, and to half transmittance"},
    {"samples", "density look-ups per pixel"},
    {"error_estimate", "the integrator's estimate of its own error"},
    {"error_bound", "what the error is proven not to exceed in any channel"},
};

std::set<std::string> parse_aovs(const std::string& list) {
  const std::vector<std::string> known = aov_names();
  std::set<std::string> chosen;
  std::istringstream names(list);
  for (std::string name; std::getline(names, name, ',');) {
    name.erase(std::remove(name.begin(), name.end(), ' '), name.end());
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      const std::string nearest = nearest_name(name, known);
      throw Error(ErrorKind::scene, SourceLoc{},
                  fmt::format("unknown AOV \"{}\"; expected {}{}", name, join_or(known),
                              nearest.empty() ? "" : "; nearest: " + nearest));
    }
    chosen.insert(name);
  }
  if (chosen.empty()) {
    throw Error(ErrorKind::scene, SourceLoc{},
                fmt::format("no AOV to write; expected some of {}", join_or(known)));
  }
  return chosen;
}

/// Adds an effect that is on where some object asks for it.
bool add_effect(EffectPlan& plan, std::string name, const std::string& causes, const std::string& why_on,
                const std::string& why_off, std::string counter) {
  const bool on = !causes.empty();
  plan.effects.push_back({std::move(name), on, on ? why_on + causes : why_off, std::move(counter)});
  return on;
}

}  // namespace

std::vector<std::string> aov_names() {
  std::vector<std::string> names;
  for (const AovInfo& aov : kAovs) names.emplace_back(aov.name);
  return names;
}

EffectPlan plan_effects(const Scene& scene) {
  EffectPlan plan;
  plan.aovs = parse_aovs(scene.render.aovs);
  std::vector<Named<Medium>> volumes = scene.volumes;
  std::erase_if(volumes, [](const Named<Medium>& volume) { return volume.object->hidden; });

  const auto dims = [](const Medium& m) { return m.extinction > 0.0; };
  const auto glows = [](const Medium& m) { return has_light(m.emission); };
  const auto scatters = [&](const Medium& m) { return dims(m) && has_light(m.albedo); };
  const std::string dimming = names_where<Medium>(volumes, dims);
  const std::string all_lights = names_where<Light>(scene.lights, [](const Light&) { return true; });
  const std::string local =
      names_where<Light>(scene.lights, [](const Light& l) { return !l.is_directional(); });
  const std::string solids =
      names_where<Shape>(scene.objects, [](const Shape& shape) { return !shape.hidden; });

  plan.media = add_effect(
      plan, "media", names_where<Medium>(volumes, [&](const Medium& m) { return dims(m) || glows(m); }),
      "volumes that dim or glow: ", volumes.empty() ? "the scene has no volume" : "no volume dims or glows",
      "density_samples");
  plan.several_media =
      add_effect(plan, "several_media", volumes.size() > 1 ? fmt::format("{}", volumes.size()) : "",
                 "coefficients add up; number of volumes: ", "at most one volume", "");
  const std::string scattering = all_lights.empty() ? "" : names_where<Medium>(volumes, scatters);
  plan.scattering =
      add_effect(plan, "scattering", scattering, "lit volumes that scatter: ",
                 all_lights.empty() ? "the scene has no light" : "no volume has extinction and albedo",
                 "source_samples");
  const auto lit_where = [&](const std::function<bool(const Medium&)>& condition) {
    return plan.scattering
               ? names_where<Medium>(volumes, [&](const Medium& m) { return scatters(m) && condition(m); })
               : "";
  };
  plan.anisotropic_phase = add_effect(
      plan, "anisotropic_phase", lit_where([](const Medium& m) { return !m.phase->is_isotropic(); }),
      "phase function is not isotropic: ", "no lit volume has a phase function that depends on direction",
      "");
  plan.multiple_scattering =
      add_effect(plan, "multiple_scattering",
                 lit_where([](const Medium& m) { return m.multiple_scattering.octaves > 1; }),
                 "octaves of scattering in: ", "no lit volume has more than one octave", "");
  plan.powder =
      add_effect(plan, "powder", lit_where([](const Medium& m) { return m.powder.strength > 0.0; }),
                 "darker where thin towards the light: ", "no lit volume has a powder strength", "");
  plan.ambient = add_effect(
      plan, "ambient",
      names_where<Medium>(volumes,
                          [&](const Medium& m) {
                            return scatters(m) && (has_light(m.ambient.top) || has_light(m.ambient.bottom));
                          }),
      "volumes in the light of a sky: ", "no volume that scatters has ambient radiance", "ambient_samples");
  plan.emission = add_effect(plan, "emission", names_where<Medium>(volumes, glows),
                             "volumes that glow: ", "no volume has emission", "");
  plan.surfaces =
      add_effect(plan, "surfaces", solids, "solid objects: ", "the scene has no object", "surface_hits");
  const auto solids_where = [&](bool (SurfaceShader::*does)() const) {
    return names_where<Shape>(scene.objects,
                              [&](const Shape& shape) { return shape.shader && ((*shape.shader).*does)(); });
  };
  plan.reflection =
      add_effect(plan, "reflection", solids_where(&SurfaceShader::is_mirror),
                 "objects that mirror their surroundings: ", "no object is a mirror", "reflected_rays");
  plan.refraction =
      add_effect(plan, "refraction", solids_where(&SurfaceShader::is_transparent),
                 "objects that are seen through: ", "no object is transparent", "refracted_rays");
  plan.textures = add_effect(plan, "textures", solids_where(&SurfaceShader::has_texture),
                             "objects with a texture: ", "no object names a texture", "texture_lookups");
  plan.holes = add_effect(
      plan, "holes", solids_where(&SurfaceShader::has_holes), "objects whose textures let light through: ",
      plan.textures ? "all textures are opaque" : "no object names a texture", "passed_rays");
  plan.sky_light = add_effect(plan, "sky_light", solids_where(&SurfaceShader::wants_sky),
                              "objects in the light of the background: ", "no object's shader asks for it",
                              "sky_light_samples");
  plan.sun_disc = add_effect(
      plan, "sun_disc", names_where<Light>(scene.lights, [](const Light& light) { return light.has_disc(); }),
      "seen as a disc: ", "no light has a disc", "");
  plan.local_lights = add_effect(plan, "local_lights", local, "lights at a finite distance: ",
                                 all_lights.empty() ? "the scene has no light" : "every light is a sun", "");
  const bool something_lit = plan.scattering || (plan.surfaces && !all_lights.empty());
  plan.media_shadows =
      add_effect(plan, "media_shadows", something_lit ? dimming : "", "light is dimmed on its way by: ",
                 something_lit ? "no volume has extinction" : "nothing is lit", "media_shadow_rays");
  const std::string casters =
      names_where<Shape>(scene.objects, [](const Shape& shape) { return shape.casts_shadow(); });
  plan.surface_shadows =
      add_effect(plan, "surface_shadows", something_lit ? casters : "", "light can be blocked by: ",
                 !something_lit   ? "nothing is lit"
                 : solids.empty() ? "the scene has no object"
                                  : "all objects are transparent",
                 "surface_shadow_rays");
  plan.fog = add_effect(
      plan, "fog", names_where<FogModel>(scene.fogs, [](const FogModel& fog) { return fog.is_visible(); }),
      "in front of what is seen: ", scene.fogs.empty() ? "the scene has no fog" : "no fog has an extinction",
      "fog_veils");
  const bool may_coarsen = scene.render.integrator && scene.render.integrator->has_level_of_detail();
  plan.level_of_detail =
      add_effect(plan, "level_of_detail",
                 may_coarsen ? names_where<Medium>(volumes, [](const Medium& m) { return m.is_grid(); }) : "",
                 "grids that may be read at coarser levels where the camera sees them from afar: ",
                 may_coarsen ? "no volume is a grid" : "the integrator reads grids as they are", "");
  for (const AovInfo& aov : kAovs) {
    const bool on = plan.aovs.count(aov.name) > 0;
    plan.effects.push_back({fmt::format("aov_{}", aov.name), on,
                            fmt::format("{}: {}", on ? "asked for" : "not asked for", aov.meaning), ""});
  }
  return plan;
}

}  // namespace pileus
