// outside PLUGIN SCENE PICTURE: loads a plugin library, renders a scene that names its plugin, saves the
// picture.
#include <cstdio>

#include <lib/core/error.h>
#include <lib/core/registry.h>
#include <lib/core/version.h>
#include <pileus/pileus.h>

int main(int, char** argv) {
  try {
    pileus::plugin_registry().load_library(argv[1]);
    const pileus::Scene scene = pileus::load(argv[2]);
    const pileus::Rendering rendering = pileus::render(scene);
    pileus::save(rendering, argv[3]);
    std::printf("pileus %s\n%d x %d\n", pileus::kVersion, rendering.image.width, rendering.image.height);
    return 0;
  } catch (const pileus::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
