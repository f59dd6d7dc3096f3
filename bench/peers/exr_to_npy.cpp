/// exr_to_npy PICTURE CHANNEL PIXELS.npy: one channel of a picture (EXR, or whatever else pileus reads) as an
/// array that NumPy loads, so that the scripts need no picture library. A picture of grey values serves as
/// any of R, G, B.
#include <cstdio>
#include <string>

#include "bench/peers/npy.h"
#include "lib/core/error.h"
#include "lib/image/image_io.h"

int main(int argc, char** argv) try {
  using namespace pileus;
  if (argc != 4) return std::fputs("usage: exr_to_npy PICTURE CHANNEL PIXELS.npy\n", stderr), 2;
  const std::string channel = argv[2];
  const Image image = read_image(argv[1]);
  const Channel* plane = image.find(channel);
  if (!plane && (channel == "R" || channel == "G" || channel == "B")) plane = image.find("Y");
  if (!plane) {
    std::string found;
    for (const Channel& each : image.channels) found += (found.empty() ? "" : ", ") + each.name;
    throw Error(ErrorKind::file, argv[1], "no channel " + channel + "; found " + found);
  }
  bench::write_npy(argv[3], plane->values, {image.height, image.width});
} catch (const std::exception& error) {
  std::fprintf(stderr, "exr_to_npy: %s\n", error.what());
  return 1;
}
