#include "lib/image/load_pictures.h"

#include <filesystem>
#include <string_view>
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

const Pictures* load_from(const fs::path& file) {
  const auto refuse = [&](const std::string& message) {
    throw Error(ErrorKind::failed, file.string(), message);
  };
  // It stays loaded for the life of the process. Binding all its libraries' functions at once takes longer.
  void* library = dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (!library) refuse(fmt::format("cannot be loaded, and pictures other than EXR need it: {}", dlerror()));

  const auto version =
      reinterpret_cast<decltype(&pileus_pictures_version)>(dlsym(library, "pileus_pictures_version"));
  const auto enter = reinterpret_cast<decltype(&pileus_pictures)>(dlsym(library, "pileus_pictures"));
  const std::string found = version && enter ? version() : "none";
  if (found == kVersion) return enter();
  dlclose(library);
  refuse(fmt::format("belongs to another pileus (version {}; expected {}): install both together", found,
                     kVersion));
  return nullptr;
}

}  // namespace

const Pictures& load_pictures() {
  static const Pictures& pictures = *load_from(own_folder() / kPicturesFile);
  return pictures;
}

}  // namespace pileus
