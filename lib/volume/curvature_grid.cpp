#include "lib/volume/curvature_grid.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>
#include <unistd.h>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/math/box.h"
#include "lib/volume/cell_stepper.h"

namespace pileus {
namespace {

/// The upper half of a float that is not below x; x >= 0.
uint16_t rounded_up(double x) {
  const float with_margin = float(x * (1.0 + 1e-6));
  uint32_t bits;
  std::memcpy(&bits, &with_margin, sizeof(bits));
  return uint16_t((bits + 0xffffu) >> 16);
}

float value_of(uint16_t upper_half) {
  const uint32_t bits = uint32_t(upper_half) << 16;
  float x;
  std::memcpy(&x, &bits, sizeof(x));
  return x;
}

/// The voxels of a brick and one layer around, [x][y][z]. In double: differences of floats then hardly round.
class Surroundings {
 public:
  static constexpr int kSize = 10;
  static constexpr std::array<int, 3> kStride = {kSize * kSize, kSize, 1};

  Surroundings(const BrickPyramid& pyramid, const Vec3i& brick) {
    const float* all = pyramid.grid().all_values().data();
    const Vec3i nodes = pyramid.levels().front().nodes;
    for (int n = 0; n < 8; ++n) {
      const Vec3i below(n & 1, n >> 1 & 1, n >> 2), from = brick - below;
      if (from.x < 0 || from.y < 0 || from.z < 0) continue;  // zeros
      const float* values =
          all + pyramid.offsets()[(size_t(from.x) * size_t(nodes.y) + size_t(from.y)) * size_t(nodes.z) +
                                  size_t(from.z)];
      // Of the brick below only its last layer but one is missing: the brick itself stores the last.
      const auto first = [](int is_below) { return is_below ? 7 : 0; };
      const auto last = [](int is_below) { return is_below ? 7 : 8; };
      for (int x = first(below.x); x <= last(below.x); ++x) {
        for (int y = first(below.y); y <= last(below.y); ++y) {
          for (int z = first(below.z); z <= last(below.z); ++z) {
            at(x + 1 - 8 * below.x, y + 1 - 8 * below.y, z + 1 - 8 * below.z) =
                double(values[x * BrickGrid::kStrideX + y * BrickGrid::kStrideY + z]);
          }
        }
      }
    }
  }

  const double* data() const { return m_values.data(); }

 private:
  double& at(int x, int y, int z) { return m_values[size_t((x * kSize + y) * kSize + z)]; }

  std::array<double, size_t(kSize) * kSize * kSize> m_values{};
};

/// The jump of the derivative along an axis, across the voxel's plane, is bilinear on that plane: it is
/// largest at one of the nine voxels in the neighbourhood.
double kink(const double* voxel, int axis) {
  const ptrdiff_t a = Surroundings::kStride[size_t(axis)], b = Surroundings::kStride[size_t(axis + 1) % 3],
                  c = Surroundings::kStride[size_t(axis + 2) % 3];
  double largest = 0.0;
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      const double* at = voxel + i * b + j * c;
      largest = std::max(largest, std::abs((at[a] - at[0]) - (at[0] - at[-a])));
    }
  }
  return largest;
}

/// The mixed derivative by two axes is linear along the third within a cell: it is largest on one of the
/// twelve faces across that axis.
double mixed(const double* voxel, int axis) {
  const ptrdiff_t a = Surroundings::kStride[size_t(axis)], b = Surroundings::kStride[size_t(axis + 1) % 3],
                  c = Surroundings::kStride[size_t(axis + 2) % 3];
  double largest = 0.0;
  for (int k = -1; k <= 1; ++k) {
    for (int i = -1; i <= 0; ++i) {
      for (int j = -1; j <= 0; ++j) {
        const double* at = voxel + k * a + i * b + j * c;
        largest = std::max(largest, std::abs((at[b + c] - at[b]) - (at[c] - at[0])));
      }
    }
  }
  return largest;
}

}  // namespace

CurvatureGrid::CurvatureGrid(const BrickPyramid& pyramid)
    : m_pyramid(&pyramid), m_size(pyramid.levels().front().nodes) {
  m_bricks.assign(size_t(m_size.x) * size_t(m_size.y) * size_t(m_size.z), kFlat);
  int32_t count = 0;
  std::vector<Vec3i> places;
  for (int x = 0; x < m_size.x; ++x) {
    for (int y = 0; y < m_size.y; ++y) {
      for (int z = 0; z < m_size.z; ++z) {
        if (is_flat({x, y, z})) continue;
        m_bricks[index_of({x, y, z})] = count++;
        places.emplace_back(x, y, z);
      }
    }
  }
  const double needed = double(count) * sizeof(Brick);
  const double memory = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
  if (needed > 0.5 * memory) {
    throw Error(ErrorKind::failed, SourceLoc{},
                fmt::format("a bound of the error needs {:.0f} GB, of {:.0f} GB here; ask for no "
                            "\"error_bound\", or clip the volume",
                            needed * 1e-9, memory * 1e-9));
  }
  m_values.resize(size_t(count) * 512);
  parallel_for(places.size(), [&](size_t i) {
    Brick bounds;
    if (!fill_brick(places[i], bounds)) m_bricks[index_of(places[i])] = kFlat;
    std::copy(bounds.begin(), bounds.end(), m_values.begin() + std::ptrdiff_t(512 * i));
  });
}

/// The neighbourhoods of a brick's voxels lie in the brick and those below it.
bool CurvatureGrid::is_flat(const Vec3i& brick) const {
  const BrickPyramid::Level& level = m_pyramid->levels().front();
  float value = 0.0f;
  for (int n = 0; n < 8; ++n) {
    const Vec3i at = brick - Vec3i(n & 1, n >> 1 & 1, n >> 2);
    const ValueRange range = at.x < 0 || at.y < 0 || at.z < 0 ? ValueRange{} : level.ranges[index_of(at)];
    if (n == 0) value = range.lo;
    if (range.lo != value || range.hi != value) return false;
  }
  return true;
}

/// Returns false where all bounds are 0.
bool CurvatureGrid::fill_brick(const Vec3i& brick, Brick& bounds) const {
  const Surroundings voxels(*m_pyramid, brick);
  bool is_bent = false;
  for (int n = 0; n < 512; ++n) {
    const int x = n >> 6, y = n >> 3 & 7, z = n & 7;
    const double* voxel =
        voxels.data() + ((x + 1) * Surroundings::kSize + (y + 1)) * Surroundings::kSize + z + 1;
    Bounds& here = bounds[size_t(n)];
    for (int axis = 0; axis < 3; ++axis) {
      here.kink[size_t(axis)] = rounded_up(kink(voxel, axis));
      here.mixed[size_t(axis)] = rounded_up(mixed(voxel, axis));
      is_bent |= (here.kink[size_t(axis)] | here.mixed[size_t(axis)]) != 0;
    }
  }
  return is_bent;
}

/// Longer steps are made of short ones: in the parameter s of the whole, each takes 1/n of the time.
double CurvatureGrid::variation_along(const Ray& line, const Vec3d& step) const {
  const double cells = std::max({std::abs(step.x), std::abs(step.y), std::abs(step.z)});
  const int parts = std::max(1, int(std::ceil(cells * (1.0 - 1e-9))));
  double sum = 0.0;
  for (int i = 0; i < parts; ++i) {
    const double middle = (i + 0.5) / parts - 0.5;
    sum += parts * variation_of_short_step({line.o + middle * step, line.d}, step / parts);
  }
  return sum;
}

/// Walks the boxes of points nearest to each voxel: from such a point, half a step along any axis stays in
/// the voxel's neighbourhood. There the derivative along the step changes by at most
///   sum over axes of |step_i| * kink_i, where the step crosses the voxel's plane,
///   + 2 * sum over pairs of |step_i * step_j| * mixed_ij.
double CurvatureGrid::variation_of_short_step(const Ray& line, const Vec3d& step) const {
  const Ray ray{line.o + Vec3d(0.5), line.d};  // the boxes are cells of a shifted grid
  Segment segment =
      clip_to_box(ray, {0.0, std::numeric_limits<double>::infinity()}, Box3d(Vec3d(0.0), Vec3d(m_size * 8)));
  if (segment.empty() || !std::isfinite(segment.t1)) return 0.0;

  const Vec3d size(std::abs(step.x), std::abs(step.y), std::abs(step.z));
  const Vec3d pairs(2.0 * size.y * size.z, 2.0 * size.z * size.x, 2.0 * size.x * size.y);
  constexpr double kRounding = 1e-6;  // of positions [cells]
  Vec3d per_cell, half_crossing;
  for (int axis = 0; axis < 3; ++axis) {
    per_cell[axis] = std::isfinite(1.0 / line.d[axis]) ? 1.0 / line.d[axis] : 0.0;
    half_crossing[axis] = (0.5 * size[axis] + kRounding) * std::abs(per_cell[axis]);
  }
  const auto crossing_length = [&](int axis, int plane, double r0, double r1) {
    if (per_cell[axis] == 0.0) {
      return std::abs(line.o[axis] - plane) <= 0.5 * size[axis] + kRounding ? r1 - r0 : 0.0;
    }
    const double r = (plane - line.o[axis]) * per_cell[axis];
    return std::max(0.0, std::min(r1, r + half_crossing[axis]) - std::max(r0, r - half_crossing[axis]));
  };

  const Vec3d entry = ray.at(segment.t0);
  Vec3i first;
  for (int axis = 0; axis < 3; ++axis) {
    first[axis] = int(std::clamp(std::floor(entry[axis]), 0.0, double(8 * m_size[axis] - 1)));
  }
  CellStepper stepper(ray, first);
  double sum = 0.0;
  for (double r = segment.t0; r < segment.t1;) {
    const Vec3i voxel = stepper.cell, brick(voxel.x >> 3, voxel.y >> 3, voxel.z >> 3);
    const int32_t found = m_bricks[index_of(brick)];
    int axis = 0;
    if (found == kFlat) {
      const CellBox box{brick * 8, brick * 8 + Vec3i(8)};
      const double exit = stepper.exit_of(box, axis);
      stepper.leap(box, axis, exit);
      r = std::max(r, exit);
    } else {
      const Bounds& here =
          m_values[size_t(found) * 512 + size_t((voxel.x & 7) << 6 | (voxel.y & 7) << 3 | (voxel.z & 7))];
      const double exit = std::clamp(stepper.t_exit(), r, segment.t1);
      for (int k = 0; k < 3; ++k) {
        sum += pairs[k] * double(value_of(here.mixed[size_t(k)])) * (exit - r);
        if (here.kink[size_t(k)] != 0) {
          sum += size[k] * double(value_of(here.kink[size_t(k)])) * crossing_length(k, voxel[k], r, exit);
        }
      }
      axis = stepper.step();
      r = exit;
    }
    if (stepper.cell[axis] < 0 || stepper.cell[axis] >= 8 * m_size[axis]) break;
  }
  return sum;
}

}  // namespace pileus
