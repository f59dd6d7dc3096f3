#include "lib/core/own_library.h"

#include <filesystem>
#include <system_error>

#include <dlfcn.h>

#include "lib/core/error.h"
#include "lib/core/version.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

/// The folder that holds this code, so that the build tree and a package that was moved work alike.
fs::path own_folder() {
  Dl_info own{};
  PILEUS_CHECK(dladdr(reinterpret_cast<const void*>(&own_folder), &own) != 0);
  std::error_code error;
  const fs::path file = fs::canonical(own.dli_fname, error);
  return (error ? fs::path(own.dli_fname) : file).parent_path();
}

}  // namespace

void* load_own_library(const std::string& file, const char* version_name, const char* function_name,
                       const std::string& purpose) {
  const fs::path path = own_folder() / file;
  const auto refuse = [&](const std::string& message) {
    throw Error(ErrorKind::failed, path.string(), message);
  };
  // Binding all its libraries' functions at once takes longer.
  void* library = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (!library) refuse(fmt::format("cannot be loaded, and {}: {}", purpose, dlerror()));

  const auto version = reinterpret_cast<const char* (*)()>(dlsym(library, version_name));
  void* const function = dlsym(library, function_name);
  const std::string found = version && function ? version() : "none";
  if (found == kVersion) return function;
  dlclose(library);
  refuse(fmt::format("belongs to another pileus (version {}; expected {}): install both together", found,
                     kVersion));
  return nullptr;
}

}  // namespace pileus
