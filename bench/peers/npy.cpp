#include "bench/peers/npy.h"

#include <cstdint>
#include <fstream>
#include <functional>
#include <numeric>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "lib/core/atomic_file.h"
#include "lib/core/error.h"

namespace pileus::bench {

void write_npy(const std::filesystem::path& file, const std::vector<float>& values,
               const std::vector<int>& shape) {
  const size_t count = std::accumulate(shape.begin(), shape.end(), size_t(1), std::multiplies<size_t>());
  PILEUS_CHECK(values.size() == count);
  // Format 1.0: the preamble is padded to a multiple of 64 bytes and ends in a line break.
  constexpr size_t kPreamble = 10;
  std::string header =
      fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({},), }}", fmt::join(shape, ", "));
  header.append(63 - (kPreamble + header.size()) % 64, ' ').push_back('\n');

  AtomicFile target(file);
  std::ofstream stream(target.path(), std::ios::binary);
  stream.write("\x93NUMPY\x01\x00", 8);
  const char length[2] = {char(header.size() & 0xff), char(header.size() >> 8)};
  stream.write(length, 2);
  stream << header;
  stream.write(reinterpret_cast<const char*>(values.data()), std::streamsize(values.size() * sizeof(float)));
  stream.close();
  if (!stream) throw Error(ErrorKind::file, file.string(), "cannot be written");
  target.commit();
}

}  // namespace pileus::bench
