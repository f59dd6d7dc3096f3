#include "vdb_io/cloud_file.h"

namespace pileus {

const std::vector<std::string>& cloud_field_names() {
  static const std::vector<std::string> names{"temperature", "Cd", "vel"};
  return names;
}

}  // namespace pileus
