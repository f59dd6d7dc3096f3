#include "lib/volume/quantized_bricks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"

namespace pileus {

double quantization_scale(float max) {
  constexpr float kSmallest = 1e-30f, kLargest = 1e38f;  // so that what follows stays among the floats
  constexpr double kSteps = 65535.0, kSignificant = 256.0;
  if (max == 0.0f) return 1.0;
  if (!(max >= kSmallest && max <= kLargest)) return 0.0;
  int exponent;
  const double mantissa = std::frexp(double(max) / kSteps, &exponent);
  return std::ldexp(std::ceil(mantissa * kSignificant) / kSignificant, exponent);
}

/// Works row by row of the pyramid's table, along z.
class QuantizedBuilder {
 public:
  explicit QuantizedBuilder(const VoxelSource& voxels) : m_voxels(voxels) {}

  BrickPyramid build() {
    m_pyramid.make_table(m_voxels.bounds().lo(), m_voxels.bounds().hi());
    m_values.scale = quantization_scale(m_voxels.max_value());
    // Two roundings of the quotient move it by less than 2^-7 of a step.
    m_values.max_error = (0.5 + 1.0 / 128.0) * m_values.scale;
    PILEUS_CHECK(m_values.scale > 0.0);
    m_nodes = m_pyramid.levels().front().nodes;
    m_rows_per_task = std::max<size_t>(1, kBricksPerTask / size_t(m_nodes.z));
    m_rows = size_t(m_nodes.x) * size_t(m_nodes.y);
    place_sources();
    number_bricks();
    allocate();
    fill_bricks();
    m_pyramid.m_quantized = std::make_shared<const QuantizedValues>(std::move(m_values));
    m_pyramid.add_levels();
    return std::move(m_pyramid);
  }

 private:
  static constexpr int32_t kNothing = -1;  ///< source: 0 everywhere; tile n is the source -2 - n, leaf n is n
  static constexpr size_t kBricksPerTask = 512;

  size_t tasks() const { return (m_rows + m_rows_per_task - 1) / m_rows_per_task; }

  size_t index_of(const Vec3i& voxel) const {
    const Vec3i at = voxel - m_pyramid.origin();
    return (size_t(at.x >> 3) * size_t(m_nodes.y) + size_t(at.y >> 3)) * size_t(m_nodes.z) +
           size_t(at.z >> 3);
  }

  void place_sources() {
    m_sources.assign(m_pyramid.m_offsets.size(), kNothing);
    const auto leaves = m_voxels.leaves();
    for (size_t i = 0; i < leaves.size(); ++i) {
      if (m_voxels.reached(i) != 0) m_sources[index_of(leaves[i].origin)] = int32_t(i);
    }
    const auto tiles = m_voxels.tiles();
    for (size_t i = 0; i < tiles.size(); ++i) {
      if (tiles[i].value > 0.0f) place_tile(tiles[i], int32_t(-2 - int(i)));
    }
    std::sort(m_shared.begin(), m_shared.end());
    m_shared.erase(std::unique(m_shared.begin(), m_shared.end()), m_shared.end());
  }

  void place_tile(const VoxelTile& tile, int32_t source) {
    m_shared.push_back(tile.value);
    const int bricks = tile.size / 8;
    for (int x = 0; x < bricks; ++x) {
      for (int y = 0; y < bricks; ++y) {
        std::fill_n(m_sources.begin() + std::ptrdiff_t(index_of(tile.origin + Vec3i(x, y, 0) * 8)), bricks,
                    source);
      }
    }
  }

  /// The sources of the corner values of the bricks of a row: its own and those of the rows above it.
  struct SourceRows {
    std::array<const int32_t*, 4> rows;  ///< [dx + 2 dy]

    std::array<int32_t, 8> at(int z) const {
      std::array<int32_t, 8> sources;
      for (size_t n = 0; n < 8; ++n) sources[n] = rows[n & 3][z + int(n >> 2)];
      return sources;
    }
    bool are_empty(int count) const {
      int32_t all = kNothing;
      for (const int32_t* row : rows) {
        for (int z = 0; z < count; ++z) all &= row[z];
      }
      return all == kNothing;
    }
  };

  /// Calls visit(first brick of the row, its sources) for the rows of a task that hold something. The table's
  /// outermost bricks hold nothing.
  template <class Visit>
  void for_rows_of(size_t task, Visit&& visit) const {
    const size_t end = std::min(m_rows, (task + 1) * m_rows_per_task), y_count = size_t(m_nodes.y),
                 z_count = size_t(m_nodes.z);
    for (size_t row = task * m_rows_per_task; row < end; ++row) {
      if (row / y_count + 1 == size_t(m_nodes.x) || row % y_count + 1 == y_count) continue;
      const int32_t* here = m_sources.data() + row * z_count;
      const SourceRows sources{
          {here, here + y_count * z_count, here + z_count, here + (y_count + 1) * z_count}};
      if (!sources.are_empty(m_nodes.z)) visit(row * z_count, sources);
    }
  }

  float uniform_value(int32_t source) const {
    return source == kNothing ? 0.0f : m_voxels.tiles()[size_t(-2 - source)].value;
  }

  /// May hold a cell that is not 0.
  bool is_wanted(const std::array<int32_t, 8>& sources) const {
    for (size_t n = 0; n < 8; ++n) {
      if (sources[n] < kNothing || (sources[n] >= 0 && (m_voxels.reached(size_t(sources[n])) >> n & 1)))
        return true;
    }
    return false;
  }

  /// True where all sources are one constant.
  bool is_uniform(const std::array<int32_t, 8>& sources) const {
    return std::all_of(sources.begin(), sources.end(), [&](int32_t source) {
      return source < 0 && uniform_value(source) == uniform_value(sources[0]);
    });
  }

  /// Makes every offset the number of its brick: counted from 1 within the task where the brick has values of
  /// its own, minus that of the shared one where it is uniform, 0 where it is empty.
  void number_bricks() {
    m_first_slots.assign(tasks() + 1, 0);
    parallel_for(tasks(), [&](size_t task) {
      int32_t count = 0;
      for_rows_of(task, [&](size_t first, const SourceRows& rows) {
        for (int z = 0; z + 1 < m_nodes.z; ++z) {
          const auto sources = rows.at(z);
          if (!is_wanted(sources)) continue;
          m_pyramid.m_offsets[first + size_t(z)] =
              is_uniform(sources) ? -shared_slot(uniform_value(sources[0])) : ++count;
        }
      });
      m_first_slots[task + 1] = count;
    });
    m_first_slots[0] = int64_t(m_shared.size()) + 1;
    for (size_t task = 0; task < tasks(); ++task) m_first_slots[task + 1] += m_first_slots[task];
  }

  /// Slot 0 holds zeros.
  int32_t shared_slot(float value) const {
    return int32_t(std::lower_bound(m_shared.begin(), m_shared.end(), value) - m_shared.begin()) + 1;
  }

  void allocate() {
    m_values.count = size_t(m_first_slots.back()) * QuantizedValues::kPitch;
    m_pyramid.check_value_count(double(m_values.count));
    const size_t bricks = size_t(m_first_slots.back());
    const double needed = double(m_values.count + bricks * QuantizedValues::kMeansPitch) * sizeof(int16_t);
    const double memory = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
    if (needed > 0.5 * memory) {
      throw Error(
          ErrorKind::failed, SourceLoc{},
          fmt::format("its bricks need {:.0f} GB, of {:.0f} GB here; clip the grid to its visible part",
                      needed * 1e-9, memory * 1e-9));
    }
    m_values.stored = make_large_array<int16_t>(m_values.count);
    m_values.means = make_large_array<int16_t>(bricks * QuantizedValues::kMeansPitch);
    fill_uniform(0, int16_t(-QuantizedValues::kZero));
    for (size_t i = 0; i < m_shared.size(); ++i) fill_uniform(i + 1, stored(m_shared[i]));
  }

  int16_t* values_of(size_t slot) { return m_values.stored.get() + slot * QuantizedValues::kPitch; }
  int16_t* means_of(size_t slot) { return m_values.means.get() + slot * QuantizedValues::kMeansPitch; }

  void fill_uniform(size_t slot, int16_t value) {
    std::fill_n(values_of(slot), QuantizedValues::kPitch, value);
    std::fill_n(means_of(slot), QuantizedValues::kMeansPitch, value);
  }

  int16_t stored(float value) const {
    const float steps = std::nearbyint(value * float(1.0 / m_values.scale));
    return int16_t(int(steps) - QuantizedValues::kZero);
  }
  float value_of(int16_t stored) const {
    return float(m_values.scale * (int(stored) + QuantizedValues::kZero));
  }

  /// Sums over bricks that hold something.
  struct Account {
    double errors = 0.0, values = 0.0, bricks = 0.0;

    void add(double error, double value) {
      errors += std::abs(error);
      values += value;
      bricks += 1.0;
    }
  };

  void fill_bricks() {
    std::vector<Account> accounts(tasks());
    parallel_for(tasks(), [&](size_t task) {
      Account& account = accounts[task];
      for_rows_of(task, [&](size_t first, const SourceRows& rows) {
        for (int z = 0; z + 1 < m_nodes.z; ++z) {
          int32_t& offset = m_pyramid.m_offsets[first + size_t(z)];
          ValueRange& range = m_pyramid.m_levels.front().ranges[first + size_t(z)];
          if (offset > 0) {
            const int64_t slot = m_first_slots[task] + offset - 1;
            offset = int32_t(slot * QuantizedValues::kPitch);
            range = fill_brick(rows.at(z), size_t(slot), account);
          } else if (offset < 0) {
            const float value = m_shared[size_t(-offset) - 1];
            offset *= -QuantizedValues::kPitch;
            range.lo = range.hi = value_of(stored(value));
            account.add(double(value - range.lo), double(value));
          }
        }
      });
    });
    Account all;
    for (const Account& some : accounts) {
      all.errors += some.errors;
      all.values += some.values;
      all.bricks += some.bricks;
    }
    m_values.mean_error = all.errors / std::max(1.0, all.bricks);
    m_values.mean_value = all.values / std::max(1.0, all.bricks);
  }

  ValueRange fill_brick(const std::array<int32_t, 8>& sources, size_t slot, Account& account) {
    constexpr double kVoxels = 512.0;
    BrickSource from;
    for (size_t n = 0; n < 8; ++n) {
      if (sources[n] >= 0) {
        from.leaves[n] = m_voxels.leaves()[size_t(sources[n])].values;
      } else {
        from.uniform_values[n] = uniform_value(sources[n]);
      }
    }
    const QuantizedBrick brick = quantize_brick(from, m_values.scale, values_of(slot), means_of(slot));
    account.add(brick.errors / kVoxels, brick.sum / kVoxels);
    return {value_of(brick.lo), value_of(brick.hi)};
  }

  const VoxelSource& m_voxels;
  BrickPyramid m_pyramid;
  QuantizedValues m_values;
  Vec3i m_nodes{0, 0, 0};
  size_t m_rows = 0, m_rows_per_task = 1;
  std::vector<int32_t> m_sources;      ///< of every brick of the table
  std::vector<float> m_shared;         ///< values of tiles, in order
  std::vector<int64_t> m_first_slots;  ///< of each task
};

BrickPyramid build_quantized_bricks(const VoxelSource& voxels) {
  return QuantizedBuilder(voxels).build();
}

}  // namespace pileus
