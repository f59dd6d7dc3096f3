#include "vdb_io/openvdb/dense_grid.h"

#include <algorithm>
#include <cmath>

#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "vdb_io/openvdb/grid_types.h"
#include "vdb_io/openvdb/grid_values.h"
#include "vdb_io/openvdb/openvdb_library.h"

namespace pileus {
namespace {

constexpr double kLargestHalf = 65504.0;

openvdb::math::Transform::Ptr transform_of(const Affine& world_from_index) {
  openvdb::Mat4R matrix;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) matrix[i][j] = world_from_index.matrix()[i][j];
  }
  return openvdb::math::Transform::createLinearTransform(matrix);
}

openvdb::GridClass class_named(const std::string& name) {
  return name == "fog volume"  ? openvdb::GRID_FOG_VOLUME
         : name == "level set" ? openvdb::GRID_LEVEL_SET
         : name == "staggered" ? openvdb::GRID_STAGGERED
                               : openvdb::GRID_UNKNOWN;
}

std::string name_of_class(openvdb::GridClass grid_class) {
  return grid_class == openvdb::GRID_FOG_VOLUME  ? "fog volume"
         : grid_class == openvdb::GRID_LEVEL_SET ? "level set"
         : grid_class == openvdb::GRID_STAGGERED ? "staggered"
                                                 : "unknown";
}

/// Value number n of the samples.
template <class Value, class Number>
Value value_at(const std::vector<Number>& samples, size_t n) {
  if constexpr (std::is_arithmetic_v<Value>) {
    return samples[n];
  } else {
    return Value(samples[3 * n], samples[3 * n + 1], samples[3 * n + 2]);
  }
}

/// The part of an axis, in samples, that leaf number `leaf` of that axis covers.
struct Range {
  int begin, end;
};
Range covered(int leaf, int first, int size) {
  return {std::max(0, 8 * leaf - first), std::min(size, 8 * leaf + 8 - first)};
}

template <class Grid, class Number>
openvdb::GridBase::Ptr sparse(const DenseVolume& volume, const std::vector<Number>& samples) {
  using Value = typename Grid::ValueType;
  const Vec3i first = volume.header.first_voxel, size = volume.size;
  const auto background = Value(Number(volume.header.background));
  const auto grid = Grid::create(background);
  const auto leaf_of = [](int voxel) { return voxel >> 3; };
  for (int z = leaf_of(first.z); z <= leaf_of(first.z + size.z - 1); ++z) {
    for (int y = leaf_of(first.y); y <= leaf_of(first.y + size.y - 1); ++y) {
      for (int x = leaf_of(first.x); x <= leaf_of(first.x + size.x - 1); ++x) {
        typename Grid::TreeType::LeafNodeType* leaf = nullptr;
        const Range is = covered(x, first.x, size.x), js = covered(y, first.y, size.y),
                    ks = covered(z, first.z, size.z);
        for (int k = ks.begin; k < ks.end; ++k) {
          for (int j = js.begin; j < js.end; ++j) {
            for (int i = is.begin; i < is.end; ++i) {
              const size_t n = (size_t(k) * size_t(size.y) + size_t(j)) * size_t(size.x) + size_t(i);
              const auto value = value_at<Value>(samples, n);
              if (value == background) continue;
              if (!leaf) leaf = grid->tree().touchLeaf(openvdb::Coord(8 * x, 8 * y, 8 * z));
              leaf->setValueOn(openvdb::Coord(first.x + i, first.y + j, first.z + k), value);
            }
          }
        }
      }
    }
  }
  return grid;
}

template <class Number>
openvdb::GridBase::Ptr sparse_of(const DenseVolume& volume, const std::vector<Number>& samples) {
  constexpr bool kIsFloat = std::is_same_v<Number, float>;
  if (volume.channels == 1) {
    return sparse<std::conditional_t<kIsFloat, openvdb::FloatGrid, openvdb::DoubleGrid>>(volume, samples);
  }
  return sparse<std::conditional_t<kIsFloat, openvdb::Vec3SGrid, openvdb::Vec3DGrid>>(volume, samples);
}

/// What values of a grid are in samples.
template <class Value>
struct SampleOf {
  using Number = std::conditional_t<std::is_same_v<Value, float> || std::is_same_v<Value, openvdb::Vec3s> ||
                                        std::is_same_v<Value, bool>,
                                    float, double>;
  static constexpr int kChannels = std::is_arithmetic_v<Value> ? 1 : 3;
};

template <class Grid>
Samples dense_samples(const Grid& grid, const openvdb::CoordBBox& box) {
  using Value = typename Grid::ValueType;
  using Number = typename SampleOf<Value>::Number;
  std::vector<Number> samples;
  samples.reserve(size_t(box.volume()) * SampleOf<Value>::kChannels);
  const auto accessor = grid.getConstAccessor();
  openvdb::Coord p;
  for (p.z() = box.min().z(); p.z() <= box.max().z(); ++p.z()) {
    for (p.y() = box.min().y(); p.y() <= box.max().y(); ++p.y()) {
      for (p.x() = box.min().x(); p.x() <= box.max().x(); ++p.x()) {
        const Value& value = accessor.getValue(p);
        if constexpr (SampleOf<Value>::kChannels == 1) {
          samples.push_back(Number(value));
        } else {
          for (int c = 0; c < 3; ++c) samples.push_back(Number(value[c]));
        }
      }
    }
  }
  return samples;
}

template <class Value>
double background_number(const std::filesystem::path& path, const std::string& name,
                         const Value& background) {
  if constexpr (std::is_arithmetic_v<Value>) {
    return double(background);
  } else {
    if (background[0] == background[1] && background[1] == background[2]) return double(background[0]);
    throw Error(
        ErrorKind::file, path.string(),
        fmt::format("grid \"{}\" has a background with different components, which a dense file cannot "
                    "tell; write .vdb or .nvdb",
                    name));
  }
}

openvdb::CoordBBox checked_box(const std::filesystem::path& path, const openvdb::GridBase& grid) {
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (box.empty()) {
    throw Error(ErrorKind::file, path.string(),
                fmt::format("grid \"{}\" is empty (0 active voxels); a dense file has one sample at least",
                            grid.getName()));
  }
  constexpr double kBytesPerVoxel = 12.0;  // a float in memory, in the file, and a vector's part of both
  double bytes = kBytesPerVoxel;
  for (int axis = 0; axis < 3; ++axis) bytes *= double(box.max()[axis]) - double(box.min()[axis]) + 1.0;
  require_memory(path.string(),
                 fmt::format("grid \"{}\", as a dense box (--resample or --crop it),", grid.getName()),
                 uint64_t(std::min(bytes, 1e18)));
  return box;
}

}  // namespace

openvdb::GridBase::Ptr grid_from_dense(const DenseVolume& volume) {
  initialize_openvdb();
  const openvdb::GridBase::Ptr grid =
      std::visit([&](const auto& samples) { return sparse_of(volume, samples); }, volume.samples);
  grid->setName(volume.header.grid);
  grid->setGridClass(class_named(volume.header.grid_class));
  grid->setTransform(transform_of(volume.header.world_from_index));
  return grid;
}

DenseVolume dense_from_grid(const std::filesystem::path& path, const openvdb::GridBase& base, bool half) {
  const openvdb::CoordBBox box = checked_box(path, base);
  DenseVolume volume;
  const bool is_known = visit_grid(base, [&](const auto& grid) {
    using Value = typename std::decay_t<decltype(grid)>::ValueType;
    volume.samples = dense_samples(grid, box);
    volume.channels = SampleOf<Value>::kChannels;
    volume.header.background = background_number(path, base.getName(), grid.background());
  });
  PILEUS_CHECK(is_known);
  volume.size = Vec3i(box.dim().x(), box.dim().y(), box.dim().z());
  volume.header.grid = base.getName();
  volume.header.grid_class = name_of_class(base.getGridClass());
  volume.header.first_voxel = Vec3i(box.min().x(), box.min().y(), box.min().z());
  volume.header.world_from_index = world_from_index(path, base);
  volume.header.channels = volume.channels;
  volume.stored = half                                                          ? SampleType::float16
                  : std::holds_alternative<std::vector<double>>(volume.samples) ? SampleType::float64
                                                                                : SampleType::float32;
  std::visit(
      [&](const auto& samples) {
        for (const auto value : samples) {
          if (half && std::isfinite(value) && std::abs(double(value)) > kLargestHalf) {
            throw Error(ErrorKind::file, path.string(),
                        fmt::format("grid \"{}\" holds {}, which half floats cannot; expected at most {}",
                                    base.getName(), value, kLargestHalf));
          }
        }
      },
      volume.samples);
  return volume;
}

}  // namespace pileus
