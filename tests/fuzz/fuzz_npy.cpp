// Any bytes as a .npy file: it is a box of samples, or there is an Error.
#include <cstddef>
#include <cstdint>

#include "lib/core/error.h"
#include "tests/fuzz/memory_file.h"
#include "vdb_io/dense/dense_files.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t size) {
  const pileus::MemoryFile file(bytes, size);
  try {
    pileus::read_npy(file.path());
  } catch (const pileus::Error&) {
  }
  return 0;
}
