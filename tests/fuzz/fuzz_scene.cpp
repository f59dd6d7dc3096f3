// Any text as a scene or cloud recipe: it is either a scene, of which a plan can be made, or gets an Error.
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "lib/core/error.h"
#include "lib/scene/effect_plan.h"
#include "lib/scene/scene.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  try {
    const std::string_view text(reinterpret_cast<const char*>(bytes), size);
    pileus::plan_effects(pileus::parse_scene(text, "fuzz.toml", ""));
  } catch (const pileus::Error&) {
  }
  return 0;
}
