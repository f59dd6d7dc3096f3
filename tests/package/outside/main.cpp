// Loads a plugin library and evaluates the phase function in it.
#include <cstdio>
#include <memory>

#include <lib/core/error.h>
#include <lib/core/registry.h>
#include <lib/core/version.h>
#include <lib/scene/phase_function.h>

int main(int, char** argv) {
  try {
    pileus::Registry& registry = pileus::plugin_registry();
    registry.load_library(argv[1]);
    const pileus::PluginInfo* info = registry.find("phase", "cornette_shanks");
    const auto phase = std::dynamic_pointer_cast<pileus::PhaseFunction>(info->make());
    const pileus::Vec3d d(0.0, 0.0, 1.0);
    std::printf("pileus %s\n%s %s, p = %.6f\n", pileus::kVersion, info->kind.c_str(), info->name.c_str(),
                phase->p(d, -d));
    return 0;
  } catch (const pileus::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
