#pragma once

#include "lib/image/pictures/pictures.h"

namespace pileus {

/// What reads and writes pictures that are not EXR: libpileus_pictures, loaded on the first call from beside
/// libpileus. errors: Error(failed) where it cannot be loaded
const Pictures& load_pictures();

}  // namespace pileus
