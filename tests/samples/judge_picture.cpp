// judge_picture PICTURE: ends with 0 where every pixel is a number and the picture is not of one colour.
#include <cmath>
#include <cstdio>

#include "lib/core/error.h"
#include "lib/image/image_io.h"

int main(int, char** argv) try {
  const pileus::Image image = pileus::read_image(argv[1]);
  size_t bad = 0;
  bool is_uniform = true;
  for (const char* name : {"R", "G", "B"}) {
    const pileus::Channel* channel = image.find(name);
    if (!channel) return std::fprintf(stderr, "%s has no channel %s\n", argv[1], name), 1;
    for (const float value : channel->values) {
      bad += !std::isfinite(value) || value < 0.0f;
      is_uniform &= value == channel->values.front();
    }
  }
  if (bad > 0) std::fprintf(stderr, "%s has %zu values that are negative or no numbers\n", argv[1], bad);
  if (is_uniform) std::fprintf(stderr, "%s shows nothing\n", argv[1]);
  return bad > 0 || is_uniform;
} catch (const pileus::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
