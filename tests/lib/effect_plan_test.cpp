#include "lib/scene/effect_plan.h"

#include <string>

#include <gtest/gtest.h>

#include "lib/core/error.h"

namespace pileus {
namespace {

EffectPlan plan_of(const std::string& text) {
  return plan_effects(parse_scene("pileus = 1\ncamera = \"perspective\"\n" + text, "s.toml", ""));
}

/// "on: because" or "off: because"
std::string effect(const EffectPlan& plan, const std::string& name) {
  for (const Effect& candidate : plan.effects) {
    if (candidate.name == name) return (candidate.on ? "on: " : "off: ") + candidate.reason;
  }
  return "no such effect";
}

const std::string kFog = "[volume.fog]\ntype = \"box\"\n", kSun = "[light.sun]\ntype = \"sun\"\n",
                  kLamp = "[light.lamp]\ntype = \"point\"\n", kBall = "[object.ball]\ntype = \"sphere\"\n";

TEST(EffectPlan, an_empty_scene_calls_for_nothing) {
  const EffectPlan plan = plan_of("");
  EXPECT_FALSE(plan.media || plan.several_media || plan.scattering || plan.emission ||
               plan.anisotropic_phase);
  EXPECT_FALSE(plan.local_lights || plan.surfaces || plan.media_shadows || plan.surface_shadows);
  EXPECT_EQ(effect(plan, "media"), "off: the scene has no volume");
  EXPECT_EQ(effect(plan, "several_media"), "off: at most one volume");
  EXPECT_EQ(effect(plan, "scattering"), "off: the scene has no light");
  EXPECT_EQ(effect(plan, "anisotropic_phase"),
            "off: no lit volume has a phase function that depends on direction");
  EXPECT_FALSE(plan.multiple_scattering || plan.powder || plan.ambient);
  EXPECT_EQ(effect(plan, "emission"), "off: no volume has emission");
  EXPECT_EQ(effect(plan, "surfaces"), "off: the scene has no object");
  EXPECT_EQ(effect(plan, "local_lights"), "off: the scene has no light");
  EXPECT_EQ(effect(plan, "media_shadows"), "off: nothing is lit");
  EXPECT_EQ(effect(plan, "surface_shadows"), "off: nothing is lit");
  EXPECT_EQ(effect(plan, "aov_beauty"), "on: asked for: radiance and alpha (R, G, B, A)");
  EXPECT_EQ(effect(plan, "aov_Z").find("off: not asked for: "), 0u);
}

TEST(EffectPlan, mirrors_and_glass_are_named) {
  const EffectPlan plain = plan_of(kSun + kBall);
  EXPECT_FALSE(plain.reflection || plain.refraction || plain.sky_light || plain.sun_disc);
  EXPECT_FALSE(plain.secondary_rays());
  EXPECT_EQ(effect(plain, "reflection"), "off: no object is a mirror");
  EXPECT_EQ(effect(plain, "refraction"), "off: no object is transparent");
  EXPECT_EQ(effect(plain, "sky_light"), "off: no object's shader asks for it");
  EXPECT_EQ(effect(plain, "sun_disc"), "off: no light has a disc");
  const EffectPlan glass = plan_of(kSun + "disc_deg = 0.5\n" + kBall + "shader = \"glass\"\n");
  EXPECT_EQ(effect(glass, "reflection"), "on: objects that mirror their surroundings: ball");
  EXPECT_EQ(effect(glass, "refraction"), "on: objects that are seen through: ball");
  EXPECT_EQ(effect(glass, "sun_disc"), "on: seen as a disc: sun");
  EXPECT_EQ(effect(glass, "surface_shadows"), "off: all objects are transparent");
  const EffectPlan mirror = plan_of(kBall + "shader = { type = \"phong\", mirror = [0, 0, 1], sky = 1 }\n");
  EXPECT_TRUE(mirror.reflection && mirror.sky_light && !mirror.refraction);
}

TEST(EffectPlan, fog_is_on_where_some_of_it_shows) {
  EXPECT_EQ(effect(plan_of(""), "fog"), "off: the scene has no fog");
  const std::string clear = "[fog.clear]\ntype = \"height\"\nextinction = 0\n";
  EXPECT_EQ(effect(plan_of(clear), "fog"), "off: no fog has an extinction");
  const EffectPlan plan = plan_of(clear + "[fog.haze]\ntype = \"distance\"\n");
  EXPECT_TRUE(plan.fog);
  EXPECT_EQ(effect(plan, "fog"), "on: in front of what is seen: haze");
}

TEST(EffectPlan, a_volume_that_neither_dims_nor_glows_is_none) {
  const EffectPlan plan = plan_of(kSun + kFog + "extinction = 0\n");
  EXPECT_FALSE(plan.media || plan.scattering || plan.media_shadows);
  EXPECT_EQ(effect(plan, "media"), "off: no volume dims or glows");
  EXPECT_EQ(effect(plan, "scattering"), "off: no volume has extinction and albedo");
}

TEST(EffectPlan, scattering_needs_light_extinction_and_albedo) {
  EXPECT_FALSE(plan_of(kFog).scattering);
  EXPECT_FALSE(plan_of(kSun + kFog + "albedo = [0, 0, 0]\n").scattering);
  const EffectPlan plan = plan_of(kSun + kFog + "albedo = [0, 0, 0.1]\n");
  EXPECT_TRUE(plan.scattering && plan.media_shadows);
  EXPECT_EQ(effect(plan, "scattering"), "on: lit volumes that scatter: fog");
  EXPECT_EQ(effect(plan, "media_shadows"), "on: light is dimmed on its way by: fog");
}

TEST(EffectPlan, the_phase_function_counts_only_where_it_is_seen) {
  const std::string peaked = "phase = { type = \"hg\", g = 0.5 }\n",
                    flat = "phase = { type = \"hg\", g = 0 }\n";
  EXPECT_FALSE(plan_of(kFog + peaked).anisotropic_phase) << "no light";
  EXPECT_FALSE(plan_of(kSun + kFog + flat).anisotropic_phase) << "g = 0 is isotropic";
  EXPECT_FALSE(plan_of(kSun + kFog + peaked + "albedo = [0, 0, 0]\n").anisotropic_phase) << "no scattering";
  EXPECT_EQ(effect(plan_of(kSun + kFog + peaked), "anisotropic_phase"),
            "on: phase function is not isotropic: fog");
}

TEST(EffectPlan, emission_needs_no_light) {
  const EffectPlan plan = plan_of(kFog + "extinction = 0\nemission = [0, 1, 0]\n");
  EXPECT_TRUE(plan.emission && plan.media);
  EXPECT_FALSE(plan.scattering || plan.media_shadows);
  EXPECT_EQ(effect(plan, "emission"), "on: volumes that glow: fog");
}

TEST(EffectPlan, octaves_and_powder_need_a_lit_volume_that_asks) {
  const std::string asks = "multiple_scattering = { octaves = 2 }\npowder = { strength = 0.1 }\n";
  for (const EffectPlan& plan :
       {plan_of(kSun + kFog), plan_of(kFog + asks), plan_of(kSun + kFog + asks + "albedo = [0, 0, 0]\n")}) {
    EXPECT_FALSE(plan.multiple_scattering || plan.powder);
    EXPECT_EQ(effect(plan, "multiple_scattering"), "off: no lit volume has more than one octave");
    EXPECT_EQ(effect(plan, "powder"), "off: no lit volume has a powder strength");
  }
  const EffectPlan plan = plan_of(kSun + kFog + asks);
  EXPECT_TRUE(plan.multiple_scattering && plan.powder);
  EXPECT_EQ(effect(plan, "multiple_scattering"), "on: octaves of scattering in: fog");
  EXPECT_EQ(effect(plan, "powder"), "on: darker where thin towards the light: fog");
}

TEST(EffectPlan, ambient_needs_no_light_but_a_volume_that_scatters) {
  const std::string asks = "ambient = { bottom = [0, 0, 1] }\n";
  const EffectPlan plan = plan_of(kFog + asks);
  EXPECT_TRUE(plan.ambient);
  EXPECT_FALSE(plan.scattering || plan.media_shadows);
  EXPECT_EQ(effect(plan, "ambient"), "on: volumes in the light of a sky: fog");
  EXPECT_EQ(effect(plan_of(kSun + kFog), "ambient"), "off: no volume that scatters has ambient radiance");
  EXPECT_FALSE(plan_of(kFog + asks + "albedo = [0, 0, 0]\n").ambient);
  EXPECT_FALSE(plan_of(kFog + asks + "extinction = 0\n").ambient);
}

TEST(EffectPlan, surfaces_and_their_shadows) {
  const EffectPlan dark = plan_of(kBall);
  EXPECT_TRUE(dark.surfaces);
  EXPECT_FALSE(dark.surface_shadows);
  const EffectPlan lit = plan_of(kBall + kSun);
  EXPECT_TRUE(lit.surface_shadows);
  EXPECT_FALSE(lit.media_shadows);
  EXPECT_EQ(effect(lit, "surface_shadows"), "on: light can be blocked by: ball");
  EXPECT_EQ(effect(lit, "media_shadows"), "off: no volume has extinction");
  EXPECT_TRUE(plan_of(kBall + kSun + kFog + "albedo = [0, 0, 0]\n").media_shadows)
      << "black fog over a lit ball";
}

TEST(EffectPlan, lights_at_a_finite_distance) {
  EXPECT_EQ(effect(plan_of(kSun), "local_lights"), "off: every light is a sun");
  EXPECT_EQ(effect(plan_of(kSun + kLamp), "local_lights"), "on: lights at a finite distance: lamp");
}

TEST(EffectPlan, several_volumes_are_counted_and_named) {
  std::string text;
  for (const char* name : {"a", "b", "c", "d", "e"})
    text += std::string("[volume.") + name + "]\ntype = \"box\"\n";
  const EffectPlan plan = plan_of(text);
  EXPECT_TRUE(plan.several_media);
  EXPECT_EQ(effect(plan, "media"), "on: volumes that dim or glow: a, b, c and 2 more");
  EXPECT_EQ(effect(plan, "several_media"), "on: coefficients add up; number of volumes: 5");
}

TEST(EffectPlan, levels_of_detail_need_a_grid) {
  EXPECT_FALSE(plan_of(kFog).level_of_detail);
  const std::string found = effect(plan_of(kFog), "level_of_detail");
  EXPECT_TRUE(found == "off: no volume is a grid" || found == "off: the integrator reads grids as they are")
      << found;
}

TEST(EffectPlan, aovs_are_those_asked_for) {
  const EffectPlan plan = plan_of("render.aovs = \"Z, samples\"\n");
  EXPECT_EQ(plan.aovs, (std::set<std::string>{"Z", "samples"}));
  for (const std::string list : {"", ",", "beauty,,Z", "Beauty", "z"}) {
    try {
      plan_of("render.aovs = \"" + list + "\"\n");
      ADD_FAILURE() << "accepted \"" << list << '"';
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::scene);
    }
  }
}

}  // namespace
}  // namespace pileus
