#include "lib/image/load_pictures.h"

#include "lib/core/own_library.h"

namespace pileus {

const Pictures& load_pictures() {
  static const auto enter = reinterpret_cast<decltype(&pileus_pictures)>(load_own_library(
      kPicturesFile, "pileus_pictures_version", "pileus_pictures", "pictures other than EXR need it"));
  return *enter();
}

}  // namespace pileus
