// A plugin library as another version of the program would have made it. Entering it would be an error.
#include <cstdlib>

extern "C" {
const char* pileus_plugin_abi();
void pileus_plugin_register(void* registry);

const char* pileus_plugin_abi() {
  return "pileus-plugin-0 of long ago";
}
void pileus_plugin_register(void*) {
  std::abort();
}
}
