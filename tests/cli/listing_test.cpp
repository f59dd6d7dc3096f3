// What the program tells about itself and about scenes and files: plugins, explain, info.
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/program.h"

namespace pileus {
namespace {

using Json = nlohmann::json;

struct Listing : testing::Test, ProgramTest {
  std::string output(const std::vector<std::string>& arguments,
                     std::vector<std::string> environment = {}) const {
    const ProgramOutcome outcome = run(arguments, std::move(environment));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return outcome.out;
  }
};

TEST_F(Listing, plugins_are_listed_by_kind) {
  const std::string list = output({"plugins"});
  for (const char* line :
       {"camera\n", "\nphase\n  hg  ", "\nvolume\n  box ", "  exact  ", "\nlight\n  point "}) {
    EXPECT_NE(list.find(line), std::string::npos) << line << "in\n" << list;
  }
}

TEST_F(Listing, one_plugin_shows_its_parameters) {
  EXPECT_EQ(output({"plugins", "hg"}),
            "phase \"hg\": one lobe, forward or backward (Henyey-Greenstein)\n"
            "  g                number, default 0, -1 < g < 1\n"
            "                   asymmetry: mean cosine of the scattering angle\n");
  EXPECT_NE(output({"plugins", "volume"}).find("volume \"cloud\""), std::string::npos);
  const ProgramOutcome unknown = run({"plugins", "hgg"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_EQ(unknown.err,
            "pileus: error: no plugin or kind \"hgg\"; `pileus plugins` lists them; nearest: hg\n");
}

TEST_F(Listing, plugins_as_json_have_every_parameter_of_every_plugin) {
  const Json plugins = Json::parse(output({"plugins", "--json"}));
  std::set<std::string> kinds;
  for (const Json& plugin : plugins) {
    kinds.insert(plugin.at("kind").get<std::string>());
    EXPECT_EQ(plugin.at("origin"), "built in");
    EXPECT_NE(plugin.at("summary"), "");
    for (const Json& param : plugin.at("params")) {
      for (const char* key : {"name", "type", "unit", "range", "help", "required"}) {
        EXPECT_TRUE(param.contains(key)) << plugin.at("name") << ": " << key;
      }
      EXPECT_EQ(param.contains("default"), !param.at("required").get<bool>()) << param;
    }
  }
  EXPECT_EQ(kinds, (std::set<std::string>{"background", "camera", "fog", "integrator", "light", "object",
                                          "phase", "surface", "texture", "volume"}));
  const Json hg = Json::parse(output({"plugins", "hg", "--json"}));
  ASSERT_EQ(hg.size(), 1u);
  EXPECT_EQ(hg[0]["params"][0]["range"], "-1 < g < 1");
}

#ifdef SAMPLE_PLUGIN
TEST_F(Listing, plugin_libraries_come_by_option_and_by_path) {
  const std::string scene =
      std::string(kSmallScene) + "[volume.b]\ntype = \"box\"\nphase = \"cornette_shanks\"\n";
  write("scene.toml", scene);
  EXPECT_EQ(run({"render", "scene.toml", "-o", "none.exr"}).exit_code, 2);
  output({"--plugin", SAMPLE_PLUGIN, "render", "scene.toml", "-o", "a.exr", "--quiet"});
  output({"render", "scene.toml", "-o", "b.exr", "--plugin", SAMPLE_PLUGIN, "--quiet"});
  output({"render", "scene.toml", "-o", "c.exr", "--quiet"},
         {std::string("PILEUS_PLUGIN_PATH=") + SAMPLE_PLUGIN_DIR});
  EXPECT_EQ(read_file(folder / "a.exr"), read_file(folder / "b.exr"));
  EXPECT_EQ(read_file(folder / "a.exr"), read_file(folder / "c.exr"));
  const Json plugin =
      Json::parse(output({"plugins", "cornette_shanks", "--json", "--plugin", SAMPLE_PLUGIN}));
  EXPECT_EQ(plugin.at(0).at("origin"), SAMPLE_PLUGIN);
}

TEST_F(Listing, files_that_are_no_plugin_library_are_refused) {
  write("text.so", "not a library");
  for (const std::string library : {"missing.so", "text.so", NOT_A_PLUGIN_LIBRARY, WRONG_ABI_LIBRARY}) {
    for (const ProgramOutcome& outcome :
         {run({"plugins", "--plugin", library}), run({"plugins"}, {"PILEUS_PLUGIN_PATH=" + library})}) {
      EXPECT_EQ(outcome.exit_code, 2) << library;
      EXPECT_EQ(outcome.out, "");
      EXPECT_NE(outcome.err.find(library), std::string::npos) << outcome.err;
      EXPECT_NE(outcome.err.find(": error: "), std::string::npos) << outcome.err;
    }
  }
}
#endif

TEST_F(Listing, explain_tells_what_is_on_and_why) {
  const std::string text = output({"explain", write("scene.toml", kSmallScene)});
  EXPECT_EQ(text.find("scene.toml: 24 x 16 pixels, integrator march, tolerance 0.002\n\nwill be simulated\n"),
            0u);
  EXPECT_NE(text.find("  scattering           lit volumes that scatter: ball\n"), std::string::npos) << text;
  EXPECT_NE(text.find("will not be simulated, and costs nothing\n"), std::string::npos);

  const Json json = Json::parse(output({"explain", "scene.toml", "--json", "--aov", "Z"}));
  EXPECT_EQ(json.at("integrator"), "march");
  EXPECT_EQ(json.at("effects").at("anisotropic_phase").at("on"), true);
  EXPECT_EQ(json.at("effects").at("surfaces").at("reason"), "the scene has no object");
  EXPECT_EQ(json.at("effects").at("aov_Z").at("on"), true);
  EXPECT_EQ(json.at("effects").at("aov_beauty").at("on"), false);
}

TEST_F(Listing, info_as_json_tells_what_a_cloud_holds) {
  write("cloud.toml", std::string(kSmallScene) + R"(
[freeform.blob]
base = { ellipsoid = { center = [0, 0, 0], radii = [1, 1, 1] } }
[volume.cumulus]
type = "cloud"
bounds = "blob"
voxel_size = 0.1
)");
  output({"cloud", "cloud.toml", "-o", "cloud.vdb", "--quiet"});
  const Json json = Json::parse(output({"info", "cloud.vdb", "--json"}));
  for (const char* key :
       {"file", "bytes", "file_version", "library_version", "creator", "default_grid", "findings"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  ASSERT_EQ(json.at("grids").size(), 1u);
  const Json& grid = json.at("grids")[0];
  EXPECT_EQ(grid.at("name"), "density");
  EXPECT_EQ(grid.at("nan"), 0);
  EXPECT_GT(grid.at("active_voxels"), 100);
  EXPECT_NEAR(grid.at("voxel_size")[0].get<double>(), 0.1, 1e-9);
  output({"render", "cloud.vdb", "-o", "cloud.png", "--size", "16x9", "--quiet"});
}

}  // namespace
}  // namespace pileus
