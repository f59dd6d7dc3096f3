#include "vdb_io/load_openvdb.h"

#include "lib/core/own_library.h"

namespace pileus {

const OpenVdbTools& load_openvdb() {
  static const auto enter = reinterpret_cast<decltype(&pileus_openvdb)>(
      load_own_library(kOpenVdbFile, "pileus_openvdb_version", "pileus_openvdb",
                       "building clouds, converting volumes and reading most of their formats need it"));
  return *enter();
}

}  // namespace pileus
