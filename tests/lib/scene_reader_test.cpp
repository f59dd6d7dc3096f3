#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/scene/key_depth.h"
#include "lib/scene/scene.h"
#include "tests/fixtures/temp_folder.h"

namespace pileus {
namespace {

constexpr const char* kHead = "pileus = 1\ncamera = \"perspective\"\n";

Scene parse(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return parse_scene(text, "s.toml", "/scenes", overrides);
}

/// Everything that is wrong with a scene, a line each; "" where it is accepted.
std::string problems(const std::string& text, const std::vector<std::string>& overrides = {},
                     ErrorKind kind = ErrorKind::scene) {
  try {
    parse(text, overrides);
  } catch (const Error& error) {
    EXPECT_EQ(int(error.kind()), int(kind)) << error.what();
    return error.what();
  }
  return "";
}

/// The problem of one line below the head (line 3), without "s.toml:3:".
std::string problem_of(const std::string& line) {
  const std::string text = problems(kHead + line);
  const std::string place = "s.toml:3:";
  return text.rfind(place, 0) == 0 ? text.substr(place.size()) : text;
}

TEST(SceneReader, an_almost_empty_scene_has_the_defaults_of_describe) {
  const Scene scene = parse(kHead);
  EXPECT_EQ(scene.file, "s.toml");
  EXPECT_EQ(scene.render.size, Vec2i(960, 540));
  EXPECT_EQ(scene.render.tolerance, 0.002);
  EXPECT_EQ(scene.render.pixel_samples, 1);
  EXPECT_EQ(scene.render.seed, 0);
  EXPECT_EQ(scene.render.aovs, "beauty");
  EXPECT_EQ(scene.render.integrator->plugin_name, "march");
  EXPECT_EQ(scene.camera->plugin_name, "perspective");
  EXPECT_EQ(scene.background->plugin_name, "constant");
  EXPECT_TRUE(scene.lights.empty() && scene.volumes.empty() && scene.objects.empty() &&
              scene.freeforms.empty());
  EXPECT_EQ(scene.display.exposure_stops, 0.0);
  EXPECT_EQ(scene.display.curve, DisplayCurve::srgb);
}

TEST(SceneReader, plugins_in_objects_have_their_defaults_too) {
  const Scene scene =
      parse(std::string(kHead) + "[volume.v]\ntype = \"box\"\n[object.o]\ntype = \"sphere\"\n");
  ASSERT_EQ(scene.volumes.size(), 1u);
  EXPECT_EQ(scene.volumes[0].name, "v");
  EXPECT_EQ(scene.volumes[0].object->extinction, 1.0);
  EXPECT_EQ(scene.volumes[0].object->albedo, Rgb(1.0));
  EXPECT_EQ(scene.volumes[0].object->phase->plugin_name, "isotropic");
  EXPECT_EQ(scene.objects[0].object->shader->plugin_name, "phong");
}

TEST(SceneReader, a_plugin_is_a_name_or_a_table) {
  const std::string name = "[volume.v]\ntype = \"box\"\nphase = \"rayleigh\"\n";
  const std::string table = "[volume.v]\ntype = \"box\"\nphase = { type = \"rayleigh\" }\n";
  for (const std::string& text : {name, table}) {
    EXPECT_EQ(parse(kHead + text).volumes[0].object->phase->plugin_name, "rayleigh");
  }
  EXPECT_EQ(problem_of("background = { radiance = [1, 1, 1] }"),
            "14: error: background: background has no type; expected type = constant or gradient");
  EXPECT_EQ(problem_of("background = 7"),
            "14: error: background: background type = 7; expected constant or gradient");
  EXPECT_EQ(problem_of("background = { type = 7 }"),
            "23: error: background: background type = 7; expected constant or gradient");
}

TEST(SceneReader, the_version_is_required_and_known) {
  const std::string camera = "camera = \"perspective\"\n";
  EXPECT_EQ(problems(camera), "s.toml:1:1: error: no version; a scene starts with `pileus = 1`");
  EXPECT_EQ(problems(camera + "pileus = 2"), "s.toml:2:10: error: pileus = 2; this program reads version 1");
  EXPECT_EQ(problems(camera + "pileus = 1.0"),
            "s.toml:2:10: error: pileus = 1.0; this program reads version 1");
  EXPECT_EQ(problems(camera + "pileus = \"1\""),
            "s.toml:2:10: error: pileus = \"1\"; this program reads version 1");
  EXPECT_EQ(
      problems("pileus = 1"),
      "s.toml:1:1: error: the scene has no [camera]; expected one with type = orthographic or perspective");
}

TEST(SceneReader, unknown_sections_and_keys_are_errors_with_the_nearest_name) {
  EXPECT_EQ(
      problem_of("lights = {}"),
      "1: error: unknown section \"lights\"; expected pileus, render, display, camera, background, light, "
      "volume, object, fog, texture or freeform; nearest: light");
  EXPECT_EQ(
      problem_of("render = { sizes = [1, 1] }"),
      "12: error: render: unknown parameter \"sizes\"; expected integrator, size, tolerance, pixel_samples, "
      "max_bounces, seed or aovs; nearest: size");
  EXPECT_EQ(problem_of("light.a = { type = \"sun\", typ = 1 }"),
            "27: error: light \"a\": unknown parameter \"typ\"; expected type, direction, irradiance or "
            "disc_deg; nearest: type");
}

TEST(SceneReader, values_where_tables_belong_and_tables_where_values_belong) {
  EXPECT_EQ(problem_of("light = 3"), "9: error: light is 3; expected a section [light]");
  EXPECT_EQ(problem_of("render = \"x\""), "10: error: render is \"x\"; expected a section [render]");
  EXPECT_EQ(problem_of("freeform.a = 1"), "14: error: freeform \"a\" is 1; expected a table");
  EXPECT_EQ(problem_of("render.tolerance = {}"),
            "20: error: render: tolerance = a table; expected a number (>= 0)");
  EXPECT_EQ(problem_of("volume.v = { type = \"cloud\", bounds = \"f\", voxel_size = 1, noise = 3 }\n"
                       "freeform.f.base.ellipsoid = {}"),
            "68: error: volume \"v\": noise = 3; expected a table { ... }");
  EXPECT_NE(problem_of("[[light]]\ntype = \"sun\""), "");
  EXPECT_NE(problem_of("[[volume.v]]\ntype = \"box\""), "");
}

TEST(SceneReader, types_are_held_to) {
  const std::string size = "expected [integer, integer] (1 <= size <= 65536)";
  EXPECT_EQ(problem_of("render.size = [1]"), "15: error: render: size = an array of 1; " + size);
  EXPECT_EQ(problem_of("render.size = [1, 2, 3]"), "15: error: render: size = an array of 3; " + size);
  EXPECT_EQ(problem_of("render.size = [1.0, 2]"), "16: error: render: size holds 1.0; " + size);
  EXPECT_EQ(problem_of("render.size = [9999999999, 2]"), "16: error: render: size holds 9999999999; " + size);
  EXPECT_EQ(problem_of("render.size = 4"), "15: error: render: size = 4; " + size);
  EXPECT_EQ(problem_of("render.pixel_samples = 2.0"),
            "24: error: render: pixel_samples = 2.0; expected an integer (1 <= pixel_samples <= 64)");
  EXPECT_EQ(problem_of("render.pixel_samples = true"),
            "24: error: render: pixel_samples = true; expected an integer (1 <= pixel_samples <= 64)");
  EXPECT_EQ(problem_of("render.seed = 2147483648"),
            "15: error: render: seed = 2147483648; expected an integer (>= 0)");
  EXPECT_EQ(problem_of("render.tolerance = \"0.1\""),
            "20: error: render: tolerance = \"0.1\"; expected a number (>= 0)");
  EXPECT_EQ(problem_of("render.tolerance = 1979-05-27"),
            "20: error: render: tolerance = a date or time; expected a number (>= 0)");
  EXPECT_EQ(problem_of("render.aovs = [\"Z\"]"),
            "15: error: render: aovs = an array of 1; expected a string");
  EXPECT_EQ(problem_of("light.a = { type = \"sun\", direction = [1, \"2\", 3] }"),
            "43: error: light \"a\": direction holds \"2\"; expected [number, number, number]");
  EXPECT_EQ(problem_of("light.a = { type = \"sun\", direction = [1, 2] }"),
            "39: error: light \"a\": direction = an array of 2; expected [number, number, number]");
  EXPECT_EQ(problem_of("volume.a = { type = \"vdb\", file = \"\" }"),
            "35: error: volume \"a\": file = \"\"; expected a file name");
  EXPECT_EQ(problem_of("display.curve = \"rgb\""),
            "17: error: display: curve = \"rgb\"; expected srgb or gamma; nearest: srgb");
}

TEST(SceneReader, integers_pass_where_numbers_are_expected) {
  EXPECT_EQ(parse(std::string(kHead) + "render.tolerance = 1\n").render.tolerance, 1.0);
}

TEST(SceneReader, numbers_must_be_finite_and_in_range) {
  EXPECT_EQ(problem_of("render.tolerance = nan"),
            "20: error: render: tolerance = nan is not a finite number");
  EXPECT_EQ(problem_of("render.tolerance = -inf"),
            "20: error: render: tolerance = -inf is not a finite number");
  EXPECT_NE(problem_of("render.tolerance = 1e999"), "");
  EXPECT_EQ(problem_of("light.a = { type = \"sun\", direction = [nan, 0, 0] }"),
            "40: error: light \"a\": direction = nan is not a finite number");
  EXPECT_EQ(problem_of("render.pixel_samples = 65"),
            "24: error: render: pixel_samples = 65 is out of range; expected 1 <= pixel_samples <= 64");
  EXPECT_EQ(problem_of("render.pixel_samples = 0"),
            "24: error: render: pixel_samples = 0 is out of range; expected 1 <= pixel_samples <= 64");
  EXPECT_EQ(problem_of("volume.a = { type = \"ellipsoid\", radii = [1, 0, 1] }"),
            "46: error: volume \"a\": radii = 0 is out of range; expected > 0");
  EXPECT_EQ(problem_of("volume.a = { type = \"box\", albedo = [0, 0, 1.01] }"),
            "44: error: volume \"a\": albedo = 1.01 is out of range; expected 0 <= albedo <= 1");
}

TEST(SceneReader, limits_themselves_are_in_or_out_as_declared) {
  EXPECT_EQ(problem_of("render.pixel_samples = 64"), "");
  EXPECT_EQ(problem_of("volume.a = { type = \"box\", albedo = [0, 1, 1] }"), "");
  EXPECT_NE(problem_of("volume.a = { type = \"box\", phase = { type = \"hg\", g = 1 } }"), "");
  EXPECT_NE(problem_of("volume.a = { type = \"box\", phase = { type = \"hg\", g = -1.0 } }"), "");
  EXPECT_EQ(problem_of("volume.a = { type = \"box\", phase = { type = \"hg\", g = -0.9999999 } }"), "");
}

TEST(SceneReader, required_parameters_are_asked_for_at_their_table) {
  EXPECT_EQ(
      problem_of("[volume.a]\ntype = \"vdb\""),
      "1: error: volume \"a\": parameter \"file\" is missing: the file: .vdb, .nvdb, .df3, .npy or .raw");
  const std::string both = problem_of("[volume.a]\ntype = \"cloud\"");
  EXPECT_NE(both.find("neither bounds nor size is given"), std::string::npos) << both;
  EXPECT_NE(both.find("voxel_size is missing"), std::string::npos) << both;
}

TEST(SceneReader, light_effects_of_volumes_must_be_in_range) {
  const auto problem_with = [](const char* group) {
    const std::string text = problem_of(std::string("volume.a = { type = \"box\", ") + group + " }");
    return text.substr(text.find("volume \"a\": ") + 12);
  };
  EXPECT_EQ(problem_with("multiple_scattering = { octaves = 0 }"),
            "multiple_scattering: octaves = 0 is out of range; expected 1 <= octaves <= 16");
  EXPECT_NE(problem_with("multiple_scattering = { octaves = 17 }"), "");
  for (const char* name : {"extinction", "contribution", "phase"}) {
    EXPECT_EQ(problem_with(fmt::format("multiple_scattering = {{ {} = 0 }}", name).c_str()),
              fmt::format("multiple_scattering: {} = 0 is out of range; expected 0 < {} <= 1", name, name));
    EXPECT_NE(problem_with(fmt::format("multiple_scattering = {{ {} = 1.01 }}", name).c_str()), "");
  }
  EXPECT_EQ(problem_with("powder = { strength = 1.5 }"),
            "powder: strength = 1.5 is out of range; expected 0 <= strength <= 1");
  EXPECT_EQ(problem_with("powder = { extinction = 0 }"),
            "powder: extinction = 0 is out of range; expected > 0");
  EXPECT_EQ(problem_with("ambient = { top = [0, -1, 0] }"),
            "ambient: top = -1 is out of range; expected >= 0");
  EXPECT_EQ(problem_with("ambient = { sky = 1 }"),
            "ambient: unknown parameter \"sky\"; expected top or bottom");
}

TEST(SceneReader, errors_of_nested_plugins_name_their_owners) {
  EXPECT_EQ(problem_of("volume.a = { type = \"box\", phase = { type = \"hg\", gg = 0 } }"),
            "51: error: volume \"a\": phase: unknown parameter \"gg\"; expected type or g; nearest: g");
  EXPECT_EQ(
      problem_of("object.o = { type = \"plane\", shader = { type = \"fong\" } }"),
      "48: error: object \"o\": unknown surface type \"fong\"; expected blinn_phong, ggx, glass or phong");
  EXPECT_EQ(problem_of("object.o = { type = \"plane\", shader = { type = \"phong\", shininess = 0 } }"),
            "69: error: object \"o\": surface: shininess = 0 is out of range; expected > 0");
}

TEST(SceneReader, values_that_do_not_go_together_are_refused_at_their_object) {
  EXPECT_EQ(problem_of("volume.a = { type = \"box\", min = [1, 0, 0], max = [0, 1, 1] }"),
            "12: error: volume \"a\": min must lie below max on every axis");
  EXPECT_EQ(problem_of("light.a = { type = \"sun\", direction = [0, 0, 0] }"),
            "11: error: light \"a\": direction is zero or not finite; expected a vector towards the light");
}

TEST(SceneReader, references_must_lead_somewhere) {
  const std::string cloud = "[volume.a]\ntype = \"cloud\"\nvoxel_size = 1\nbounds = \"blob\"\n";
  EXPECT_EQ(problems(kHead + cloud),
            "s.toml:6:10: error: volume \"a\": there is no freeform \"blob\"; the scene has none");
  EXPECT_EQ(
      problems(kHead + cloud + "[freeform.blop]\nbase = { ellipsoid = {} }\n"),
      "s.toml:6:10: error: volume \"a\": there is no freeform \"blob\"; the scene has blop; nearest: blop");
  EXPECT_EQ(problems(kHead + cloud + "[freeform.blob]\nbase = { ellipsoid = {} }\n"), "");
}

TEST(SceneReader, files_are_relative_to_the_scene) {
  const TempFolder folder;
  std::filesystem::create_directory(folder / "sub");
  std::ofstream(folder / "sub/s.toml") << kHead << "[volume.a]\ntype = \"vdb\"\nfile = \"a.vdb\"\n";
  const Scene scene = load_scene(folder / "sub/s.toml");
  try {
    scene.volumes[0].object->build({});
    ADD_FAILURE() << "read a file that is not there";
  } catch (const Error& error) {
    EXPECT_EQ(error.diagnostics()[0].loc.file, (folder / "sub/a.vdb").string());
  }
}

TEST(SceneReader, problems_come_in_the_order_of_the_file) {
  EXPECT_EQ(
      problems("pileus = 1\nvolume.z = { type = \"box\", extinction = -1 }\nrender.seed = -1\n"
               "light.a = { type = \"son\" }\ncamera = \"perspective\"\n"),
      "s.toml:2:41: error: volume \"z\": extinction = -1 is out of range; expected >= 0\n"
      "s.toml:3:15: error: render: seed = -1 is out of range; expected >= 0\n"
      "s.toml:4:20: error: light \"a\": unknown light type \"son\"; expected point or sun; nearest: sun");
}

TEST(SceneReader, overrides_set_and_add) {
  const Scene scene = parse(kHead, {"render.size=[3, 4]", "render.aovs=beauty,Z", "light.sun.type=sun",
                                    "volume.v={ type = \"box\", extinction = 3 }", "volume.v.extinction=4",
                                    "camera=orthographic", "render.seed=5"});
  EXPECT_EQ(scene.render.size, Vec2i(3, 4));
  EXPECT_EQ(scene.render.aovs, "beauty,Z");
  EXPECT_EQ(scene.lights.at(0).name, "sun");
  EXPECT_EQ(scene.volumes.at(0).object->extinction, 4.0) << "the last one wins";
  EXPECT_EQ(scene.camera->plugin_name, "orthographic");
}

TEST(SceneReader, overrides_that_cannot_be_are_named_as_given) {
  EXPECT_EQ(problems(kHead, {"render.size=[0, 4]"}),
            "--set render.size=[0, 4]: error: render: size = 0 is out of range; expected 1 <= size <= 65536");
  EXPECT_EQ(problems(kHead, {"rendr.size=1"}),
            "--set rendr.size=1: error: unknown section \"rendr\"; expected pileus, render, display, camera, "
            "background, light, volume, object, fog, texture or freeform; nearest: render");
  EXPECT_EQ(problems(kHead, {"camera.type=perspective"}, ErrorKind::usage),
            "--set camera.type=perspective: error: \"camera\" is \"perspective\", not a table");
  for (const std::string text : {"", "=", "a", "=1", ".=1", "a.=1", ".a=1", "a..b=1"}) {
    EXPECT_EQ(problems(kHead, {text}, ErrorKind::usage),
              "--set " + text + ": error: expected path.to.key=value");
  }
  EXPECT_EQ(problems(kHead, {"render.seed=1\nother = 2"}, ErrorKind::usage),
            "--set render.seed=1\nother = 2: error: expected a single value");
}

TEST(SceneReader, the_hash_follows_the_content_not_the_layout) {
  const uint64_t hash = parse(kHead).hash;
  EXPECT_EQ(parse("# a comment\n" + std::string(kHead) + "\n").hash, hash);
  EXPECT_NE(parse(kHead, {"render.seed=1"}).hash, hash);
  EXPECT_EQ(parse(kHead, {"render.seed=1"}).hash, parse(std::string(kHead) + "render.seed = 1").hash);
}

TEST(SceneReader, files_that_cannot_be_read) {
  const TempFolder folder;
  for (const auto& path : {folder / "missing.toml", folder.path()}) {
    try {
      load_scene(path);
      ADD_FAILURE() << path;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::file);
      EXPECT_EQ(std::string(error.what()).find(path.string() + ": error: cannot be "), 0u) << error.what();
    }
  }
}

// ---- key_depth ----

std::string dotted(size_t parts) {
  std::string key = "a";
  for (size_t i = 1; i < parts; ++i) key += ".a";
  return key;
}

std::string depth_problem(const std::string& text) {
  try {
    check_key_depth(text, "s.toml");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(KeyDepth, holds_keys_and_headers_to_the_limit) {
  EXPECT_EQ(depth_problem(dotted(kMaxKeyParts) + " = 1"), "");
  EXPECT_EQ(depth_problem("[" + dotted(kMaxKeyParts) + "]"), "");
  EXPECT_EQ(depth_problem("b = 1\n" + dotted(kMaxKeyParts + 1) + " = 1"),
            "s.toml:2:128: error: a key has more than 64 parts");
  EXPECT_NE(depth_problem("[" + dotted(kMaxKeyParts + 1) + "]"), "");
  EXPECT_NE(depth_problem("b = { " + dotted(kMaxKeyParts + 1) + " = 1 }"), "");
}

TEST(KeyDepth, dots_elsewhere_are_no_keys) {
  const std::string dots(1000, '.');
  for (const std::string& text :
       {"# " + dots + "\na = 1", "a = \"" + dots + "\"", "a = '" + dots + "'",
        "a = \"\"\"\n" + dots + "\n\"\"\"", "a = \"\\\"" + dots + "\"",
        "a = \"\"\"" + dots + "\"\"\"\"\"\nb = '" + dots + "'", "a = '''\n" + dots + "'''"}) {
    EXPECT_EQ(depth_problem(text), "") << text.substr(0, 20);
  }
  std::string numbers = "a = [";
  for (int i = 0; i < 1000; ++i) numbers += "0.5, ";
  EXPECT_EQ(depth_problem(numbers + "]"), "");
}

TEST(KeyDepth, strings_hide_nothing) {
  for (const std::string before :
       {"a = \"\"\"x\"\"\"\"\n", "a = ''\n", "a = \"\"\n", "a = '''it''s'''\n", "# '\n"}) {
    EXPECT_NE(depth_problem(before + dotted(kMaxKeyParts + 1) + " = 1"), "") << before;
  }
  std::string quoted;
  for (size_t i = 0; i <= kMaxKeyParts; ++i) quoted += "\"=,\".";
  EXPECT_NE(depth_problem(quoted + "a = 1"), "");
}

}  // namespace
}  // namespace pileus
