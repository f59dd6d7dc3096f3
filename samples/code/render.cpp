// render SCENE PICTURE: the whole of a renderer on the public interface.
#include <cstdio>

#include <pileus/pileus.h>

int main(int argc, char** argv) try {
  if (argc != 3) return std::fputs("usage: render SCENE.toml PICTURE.png\n", stderr), 2;
  const pileus::Scene scene = pileus::load(argv[1]);
  const pileus::Rendering rendering = pileus::render(scene);
  pileus::save(rendering, argv[2]);
} catch (const pileus::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
