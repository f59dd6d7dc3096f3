#include <cmath>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/core/param_table.h"
#include "lib/core/registry.h"
#include "lib/scene/phase_function.h"

namespace pileus {
namespace {

/// What load_library says about a file that it refuses; "" where it takes it.
std::string refusal(const std::string& file) {
  Registry registry;
  try {
    registry.load_library(file);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    EXPECT_TRUE(registry.all().empty());
    return error.what();
  }
  return "";
}

void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "\"" << part << "\" is not in: " << text;
}

std::shared_ptr<const PhaseFunction> cornette_shanks(double g) {
  Registry registry;
  registry.load_library(SAMPLE_PLUGIN);
  const std::shared_ptr<Plugin> plugin = registry.find("phase", "cornette_shanks")->make();
  ParamTable params;
  plugin->describe(params);
  *std::get<double*>(params.params().at(0).target) = g;
  return std::dynamic_pointer_cast<const PhaseFunction>(plugin);
}

TEST(PluginLibrary, is_found_under_its_name_and_origin) {
  Registry registry;
  registry.load_library(SAMPLE_PLUGIN);
  ASSERT_EQ(registry.all().size(), 1u);
  const PluginInfo& info = registry.all().front();
  EXPECT_EQ(info.kind, "phase");
  EXPECT_EQ(info.name, "cornette_shanks");
  EXPECT_EQ(info.origin, SAMPLE_PLUGIN);

  const std::shared_ptr<Plugin> plugin = info.make();
  ParamTable params;
  plugin->describe(params);
  ASSERT_EQ(params.params().size(), 1u);
  EXPECT_EQ(range_text(params.params().front()), "-1 < g < 1");
}

TEST(PluginLibrary, loaded_twice_is_refused_and_leaves_the_registry_as_it_was) {
  Registry registry;
  registry.load_library(SAMPLE_PLUGIN);
  EXPECT_THROW(registry.load_library(SAMPLE_PLUGIN), Error);
  EXPECT_EQ(registry.all().size(), 1u);

  struct Flat final : PhaseFunction {
    void describe(ParamTable&) override {}
    double p(const Vec3d&, const Vec3d&) const override { return 0.25 * std::numbers::inv_pi; }
  };
  registry.add<PhaseFunction, Flat>("flat", "");
  EXPECT_EQ(registry.find("phase", "flat")->origin, "built in");
}

TEST(PluginLibrary, of_another_interface_is_refused) {
  const std::string message = refusal(WRONG_ABI_LIBRARY);
  expect_contains(message, "wrong_abi.so");
  expect_contains(message, "pileus-plugin-0 of long ago");
  expect_contains(message, PILEUS_PLUGIN_ABI);
}

TEST(PluginLibrary, that_is_no_plugin_is_refused) {
  expect_contains(refusal(NOT_A_PLUGIN_LIBRARY), "not a pileus plugin");
}

TEST(PluginLibrary, that_is_missing_or_no_library_is_refused) {
  expect_contains(refusal("/nowhere/none.so"), "none.so: error: cannot load plugin");
  const std::string file = testing::TempDir() + "pileus_text.so";
  std::ofstream(file) << "not a library\n";
  expect_contains(refusal(file), "cannot load plugin");
  expect_contains(refusal(testing::TempDir()), "cannot load plugin");
}

// The registry of the process reads the variable once: no other test of this program may ask for it.
TEST(PluginLibrary, is_loaded_from_the_folders_of_the_plugin_path) {
  setenv("PILEUS_PLUGIN_PATH", ":" SAMPLE_PLUGIN_DIR ":", 1);
  const PluginInfo* info = plugin_registry().find("phase", "cornette_shanks");
  ASSERT_NE(info, nullptr);
  EXPECT_EQ(info->origin, SAMPLE_PLUGIN);
  EXPECT_NE(plugin_registry().find("phase", "isotropic"), nullptr);
}

/// Integrals of p and of p * cos over the sphere, by Simpson's rule in the angle from the forward direction.
struct Moments {
  double p = 0.0, cosine = 0.0;
};
Moments moments(const PhaseFunction& phase) {
  const Vec3d wi(0.0, 0.0, -1.0);
  const int n = 20000;
  Moments result;
  for (int i = 0; i <= n; ++i) {
    const double theta = std::numbers::pi * i / n;
    const double weight = i == 0 || i == n ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    const Vec3d wo(std::sin(theta), 0.0, std::cos(theta));
    const double ring = 2.0 * std::numbers::pi * std::sin(theta) * weight * std::numbers::pi / (3.0 * n);
    result.p += ring * phase.p(wo, wi);
    result.cosine += ring * phase.p(wo, wi) * std::cos(theta);
  }
  return result;
}

TEST(CornetteShanks, is_normalised_and_has_its_mean_cosine) {
  for (const double g : {0.0, 0.3, -0.7, 0.95}) {
    const Moments found = moments(*cornette_shanks(g));
    EXPECT_NEAR(found.p, 1.0, 1e-9) << "g = " << g;
    EXPECT_NEAR(found.cosine, 0.6 * g * (4.0 + g * g) / (2.0 + g * g), 1e-9) << "g = " << g;
  }
}

TEST(CornetteShanks, without_asymmetry_is_rayleighs) {
  const auto phase = cornette_shanks(0.0);
  const Vec3d wi(0.0, 0.0, -1.0);
  EXPECT_DOUBLE_EQ(phase->p({1.0, 0.0, 0.0}, wi), 3.0 / (16.0 * std::numbers::pi));
  EXPECT_DOUBLE_EQ(phase->p({0.0, 0.0, 1.0}, wi), 3.0 / (8.0 * std::numbers::pi));
}

TEST(CornetteShanks, stays_finite_and_accurate_at_its_narrowest_peak) {
  // At theta = 0 and g -> 1 the quotient is 3 (1 + g) / (4 pi (2 + g^2) (1 - g)^2).
  const double g = 1.0 - 0x1p-40;
  const double peak = 0.75 * std::numbers::inv_pi * (1.0 + g) / (2.0 + g * g) * 0x1p80;
  const Vec3d forward(0.0, 0.0, 1.0);
  EXPECT_DOUBLE_EQ(cornette_shanks(g)->p(forward, -forward), peak);
  EXPECT_DOUBLE_EQ(cornette_shanks(-g)->p(forward, forward), peak);
  EXPECT_GT(cornette_shanks(g)->p(forward, forward), 0.0);
}

}  // namespace
}  // namespace pileus
