#include "lib/terrain/height_table.h"

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"

namespace pileus {

void check_table_size(const std::filesystem::path& file, int64_t columns, int64_t rows) {
  constexpr int64_t kMostNodes = 1 << 20;  // per side
  if (columns < 2 || rows < 2 || columns > kMostNodes || rows > kMostNodes) {
    throw Error(ErrorKind::file, file.string(),
                fmt::format("is a table of {} x {} heights; expected 2 to {} along both sides", columns, rows,
                            kMostNodes));
  }
  // As read (up to 8 bytes a height), as kept, and the pyramid of minima, maxima, deviations and corners.
  const uint64_t bytes = uint64_t(columns) * uint64_t(rows) * 17;
  if (bytes > memory_budget()) {
    throw Error(ErrorKind::file, file.string(),
                fmt::format("is a table of {} x {} heights, which takes {}; expected at most {}", columns,
                            rows, bytes_text(bytes), bytes_text(memory_budget())));
  }
}

}  // namespace pileus
