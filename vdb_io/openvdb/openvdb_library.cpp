#include "vdb_io/openvdb/openvdb_library.h"

#include <openvdb/openvdb.h>

namespace pileus {

void initialize_openvdb() {
  static const bool done = [] {
    openvdb::initialize();
    return true;
  }();
  (void)done;
}

}  // namespace pileus
