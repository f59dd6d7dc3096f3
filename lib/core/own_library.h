#pragma once

#include <string>

namespace pileus {

/// Loads a library of pileus's own from beside libpileus, for the life of the process, and finds a function
/// in it.
///   file          such as "libpileus_pictures.so"
///   version_name  a function `const char*()` of the library: it must be of the same pileus
///   purpose       as in "pictures other than EXR need it"
/// errors: Error(failed) where it cannot be loaded or belongs to another pileus
void* load_own_library(const std::string& file, const char* version_name, const char* function_name,
                       const std::string& purpose);

}  // namespace pileus
