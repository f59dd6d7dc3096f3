#include "integrators/kernels/march_kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/core/build_features.h"
#include "lib/math/transmittance.h"
#include "lib/volume/node_walker.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "integrators/kernels/march_kernel.cpp"
#include "hwy/foreach_target.h"  // compiles this file again for each target
#include "hwy/highway.h"

#include "lib/simd/exponential-inl.h"
#include "lib/simd/trilinear-inl.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using DI = hn::RebindToSigned<D>;
using V = hn::Vec<D>;
using VI = hn::Vec<DI>;
constexpr size_t kLanes = hn::MaxLanes(D());

/// Positions along a ray in some space, o + t * d, for a whole vector of t.
struct LinePath {
  float o[3], d[3];

  LinePath() = default;
  LinePath(const Vec3d& origin, const Vec3d& direction) {
    for (int axis = 0; axis < 3; ++axis) o[axis] = float(origin[axis]), d[axis] = float(direction[axis]);
  }
  HWY_INLINE V at(int axis, V t) const {
    const D tag;
    return hn::MulAdd(t, hn::Set(tag, d[axis]), hn::Set(tag, o[axis]));
  }
};

/// Densities of a grid, by way of the table of bricks.
class GridReader {
 public:
  explicit GridReader(const BrickPyramid& pyramid)
      : values(pyramid.grid().all_values().data()), offsets(pyramid.offsets().data()) {
    const Vec3i n = pyramid.levels().front().nodes;
    stride_x = n.y * n.z;
    stride_y = n.z;
    for (int axis = 0; axis < 3; ++axis) last[axis] = 8.0f * float(n[axis]) - 1.0f;
  }

  /// kClamp: where positions may lie far outside. Rounding alone never leaves the table's border of zeros.
  template <bool kClamp>
  HWY_INLINE V read(V x, V y, V z) const {
    if constexpr (kClamp) clamp(x, y, z);
    return interpolate(brick_of(x, y, z), x, y, z);
  }

  /// The same for positions of which many lie in empty bricks or outside.
  HWY_INLINE V read_or_skip(V x, V y, V z) const {
    const D d;
    const DI di;
    clamp(x, y, z);
    const VI brick = brick_of(x, y, z);
    if (hn::AllTrue(di, hn::Eq(brick, hn::Zero(di)))) return hn::Zero(d);
    return interpolate(brick, x, y, z);
  }

 private:
  HWY_INLINE void clamp(V& x, V& y, V& z) const {
    const D d;
    x = hn::Max(hn::Zero(d), hn::Min(x, hn::Set(d, last[0])));
    y = hn::Max(hn::Zero(d), hn::Min(y, hn::Set(d, last[1])));
    z = hn::Max(hn::Zero(d), hn::Min(z, hn::Set(d, last[2])));
  }

  /// Where the values of the bricks begin.
  HWY_INLINE VI brick_of(V x, V y, V z) const {
    const DI di;
    const VI ix = hn::ShiftRight<3>(hn::ConvertTo(di, x)), iy = hn::ShiftRight<3>(hn::ConvertTo(di, y)),
             iz = hn::ShiftRight<3>(hn::ConvertTo(di, z));
    const VI index =
        hn::Add(hn::Add(hn::Mul(ix, hn::Set(di, stride_x)), hn::Mul(iy, hn::Set(di, stride_y))), iz);
    return hn::GatherIndex(di, offsets, index);
  }

  HWY_INLINE V interpolate(VI brick, V x, V y, V z) const {
    const D d;
    const DI di;
    const VI ix = hn::ConvertTo(di, x), iy = hn::ConvertTo(di, y), iz = hn::ConvertTo(di, z);
    const VI seven = hn::Set(di, 7);
    const VI cell = hn::Add(hn::Add(hn::Mul(hn::And(ix, seven), hn::Set(di, BrickGrid::kStrideX)),
                                    hn::Mul(hn::And(iy, seven), hn::Set(di, BrickGrid::kStrideY))),
                            hn::And(iz, seven));
    return trilinear(d, values, hn::Add(brick, cell), BrickGrid::kStrideX, BrickGrid::kStrideY,
                     hn::Sub(x, hn::ConvertTo(d, ix)), hn::Sub(y, hn::ConvertTo(d, iy)),
                     hn::Sub(z, hn::ConvertTo(d, iz)));
  }

  const float* values;
  const int32_t* offsets;
  int stride_x, stride_y;  ///< of the table
  float last[3];           ///< largest position that still has a cell
};

/// Optical depths of a lattice; positions beyond it count as its border.
struct LatticeReader {
  const float* tau;
  int stride_u, stride_v;
  float last[3];

  explicit LatticeReader(const SunLattice& lattice)
      : tau(lattice.tau.get()), stride_u(lattice.size.y * lattice.size.z), stride_v(lattice.size.z) {
    // Below the last node, so that its cell exists.
    for (int axis = 0; axis < 3; ++axis) last[axis] = std::nextafter(float(lattice.size[axis] - 1), 0.0f);
  }

  HWY_INLINE V read(const LinePath& path, V t) const {
    const D d;
    const DI di;
    V at[3];
    VI cell[3];
    for (int axis = 0; axis < 3; ++axis) {
      const V p = hn::Max(hn::Zero(d), hn::Min(path.at(axis, t), hn::Set(d, last[axis])));
      cell[axis] = hn::ConvertTo(di, p);
      at[axis] = hn::Sub(p, hn::ConvertTo(d, cell[axis]));
    }
    const VI index = hn::Add(
        hn::Add(hn::Mul(cell[0], hn::Set(di, stride_u)), hn::Mul(cell[1], hn::Set(di, stride_v))), cell[2]);
    return trilinear(d, tau, index, stride_u, stride_v, at[0], at[1], at[2]);
  }
};

Segment clip_to_bounds(const Box3d& box, const Ray& ray, Segment segment) {
  for (int axis = 0; axis < 3; ++axis) {
    if (ray.d[axis] == 0.0) {
      if (!(ray.o[axis] >= box.min[axis] && ray.o[axis] <= box.max[axis])) return {};
      continue;
    }
    const double inverse = 1.0 / ray.d[axis];
    const double a = (box.min[axis] - ray.o[axis]) * inverse, b = (box.max[axis] - ray.o[axis]) * inverse;
    segment.t0 = std::max(segment.t0, std::min(a, b));
    segment.t1 = std::min(segment.t1, std::max(a, b));
  }
  return segment;
}

Ray local_ray(const MarchGrid& grid, const Ray& ray) {
  return {grid.local_from_world.point(ray.o), grid.local_from_world.direction(ray.d)};
}

/// All rays of a tile at once: intervals that hold their origins and directions.
class Beam {
 public:
  Beam(const MarchGrid& grid, std::span<const MarchRay> rays) {
    for (const MarchRay& job : rays) {
      const Ray ray = local_ray(grid, job.ray);
      m_o.extendBy(ray.o);
      m_d.extendBy(ray.d);
    }
  }

  /// True where no ray can meet the box: interval arithmetic on the slabs. Axes along which rays go either
  /// way say nothing.
  bool misses(const Box3d& box) const {
    double enter = 0.0, leave = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      if (!(m_d.min[axis] > 0.0 || m_d.max[axis] < 0.0)) continue;
      const bool is_up = m_d.min[axis] > 0.0;
      const double near = is_up ? box.min[axis] - m_o.max[axis] : m_o.min[axis] - box.max[axis];
      const double far = is_up ? box.max[axis] - m_o.min[axis] : m_o.max[axis] - box.min[axis];
      const double slowest = is_up ? m_d.min[axis] : -m_d.max[axis],
                   fastest = is_up ? m_d.max[axis] : -m_d.min[axis];
      if (far < 0.0) return true;
      enter = std::max(enter, near / fastest);
      leave = std::min(leave, far / slowest);
    }
    return enter > leave * (1.0 + 1e-12);
  }

 private:
  Box3d m_o, m_d;
};

/// The stretches of one grid along a ray.
class GridWalk {
 public:
  /// ray: local; segment: inside the grid's bounds
  GridWalk(const MarchGrid& grid, const Ray& ray, const Segment& segment)
      : m_walker(*grid.pyramid, ray, segment),
        m_whole(grid.pyramid->levels().back().ranges[0]),
        m_extinction(grid.extinction),
        m_voxel(1.0 / length(ray.d)) {
    if (!segment.empty()) now.t0 = now.t1 = segment.t0;
  }

  bool next() { return m_walker.next(now); }

  /// Moves on to the stretch that ends behind t, or to infinity.
  void pass(double t) {
    while (now.t1 <= t) {
      if (!next()) now.t0 = now.t1 = std::numeric_limits<double>::infinity();
    }
  }

  const ValueRange& whole() const { return m_whole; }  ///< of the grid
  double extinction() const { return m_extinction; }
  double voxel() const { return m_voxel; }  ///< length of a voxel's edge along the ray [m]

  NodeWalker::Stretch now{
      std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), {}};

 private:
  NodeWalker m_walker;
  ValueRange m_whole;
  double m_extinction, m_voxel;
};

/// Moves lanes up by 1, 2, 4, ... places; what enters below comes from elsewhere. Everything stays in
/// registers: a vector stored and loaded again at another offset would wait for the store to reach the cache.
class LaneShifter {
 public:
  LaneShifter() {
    for (size_t k = 0; k < kSteps; ++k) {
      for (size_t i = 0; i < kLanes; ++i) m_from[k][i] = int32_t((i + kLanes - (size_t(1) << k)) % kLanes);
    }
  }

  /// Lane i of v goes to lane i + 2^k; the last ones come round to the front.
  HWY_INLINE V rotate(V v, size_t k) const {
    const D d;
    const DI di;
    return hn::TableLookupLanes(v, hn::IndicesFromVec(d, hn::Load(di, m_from[k])));
  }

  /// The same, with the front lanes taken from another rotated vector.
  HWY_INLINE V shift(V rotated, V front, size_t k) const {
    const D d;
    return hn::IfThenElse(hn::FirstN(d, size_t(1) << k), front, rotated);
  }

  /// Product of all lanes up to and including each.
  HWY_INLINE V running_product(V v) const {
    const D d;
    const V one = hn::Set(d, 1.0f);
    for (size_t k = 0; (size_t(1) << k) < kLanes; ++k) v = hn::Mul(v, shift(rotate(v, k), one, k));
    return v;
  }

 private:
  static constexpr size_t kSteps = 4;
  alignas(64) int32_t m_from[kSteps][kLanes];
};

/// Neighbouring samples of a quantity along a ray, across vectors.
class SampleHistory {
 public:
  void reset() {
    const D d;
    hn::Store(hn::Zero(d), d, m_rotated1);
    hn::Store(hn::Zero(d), d, m_rotated2);
  }

  /// The samples before those of v, and those before them.
  HWY_INLINE void push(const LaneShifter& lanes, V v, V& before1, V& before2) {
    const D d;
    const V r1 = lanes.rotate(v, 0), r2 = lanes.rotate(v, 1);
    before1 = lanes.shift(r1, hn::Load(d, m_rotated1), 0);
    before2 = lanes.shift(r2, hn::Load(d, m_rotated2), 1);
    hn::Store(r1, d, m_rotated1);
    hn::Store(r2, d, m_rotated2);
  }
  HWY_INLINE V push(const LaneShifter& lanes, V v) {
    const D d;
    const V r1 = lanes.rotate(v, 0), before = lanes.shift(r1, hn::Load(d, m_rotated1), 0);
    hn::Store(r1, d, m_rotated1);
    return before;
  }

 private:
  alignas(64) float m_rotated1[kLanes], m_rotated2[kLanes];
};

/// Marches one ray after the other.
///   kGrids:  1, with extinction; or 0: any
///   kLights: 0 or 1; or -1: any
///   kPlain:  one scatter term, and no light that varies with height
template <int kGrids, int kLights, bool kPlain>
class Marcher {
 public:
  explicit Marcher(const MarchScene& scene) : m_scene(scene) {
    for (const MarchGrid& grid : scene.grids) m_grids.emplace_back(*grid.pyramid);
    for (const SunLattice& lattice : scene.lattices) m_lattices.emplace_back(lattice);
    m_paths.resize(m_grids.size());
    m_sun_paths.resize(m_lattices.size());
    for (const MarchGrid& grid : scene.grids) m_extinctions.push_back(float(grid.extinction));
    m_rhos.resize(m_grids.size() * kLanes);
    m_accumulators.resize(m_grids.size() * sums_per_grid(scene) * kLanes);
  }

  void march(const MarchRay& job, MarchResult& result, double* sums) {
    begin(job);
    if constexpr (kGrids == 1) {
      const MarchGrid& grid = m_scene.grids[0];
      const Ray local = local_ray(grid, job.ray);
      const Segment inside = clip_to_bounds(grid.bounds, local, job.segment);
      if (inside.empty()) return miss(result, sums);
      clear_sums();
      walk_one(GridWalk(grid, local, inside));
    } else {
      clear_sums();
      walk_all(job);
    }
    finish(result, sums);
  }

  /// The answer for a ray that meets nothing.
  void miss(MarchResult& result, double* sums) const {
    result = {};
    result.z_half = std::numeric_limits<double>::infinity();
    result.first = {result.z_half, result.z_half};
    std::fill_n(sums, m_scene.grids.size() * sums_per_grid(m_scene), 0.0);
  }

 private:
  static constexpr bool kClamp = kGrids != 1;
  int grids() const { return kGrids > 0 ? kGrids : int(m_grids.size()); }
  int lights() const { return kLights >= 0 ? kLights : m_scene.lights; }

  void begin(const MarchRay& job) {
    m_job = &job;
    m_queued = 0;
    m_transmittance = 1.0;
    m_samples = m_lookups = m_leaps = 0;
    m_z_half = std::numeric_limits<double>::infinity();
    m_first = {m_z_half, m_z_half};
    m_has_met = false;
    m_is_placed = false;
  }

  void clear_sums() {
    const D d;
    hn::Store(hn::Zero(d), d, m_tau);
    hn::Store(hn::Zero(d), d, m_error2);
    std::fill(m_accumulators.begin(), m_accumulators.end(), 0.0f);
    for (SampleHistory* history : {&m_lit, &m_sigma, &m_bright, &m_weight}) history->reset();
  }

  /// Kernel positions are counted from the entry of the first medium: floats then suffice.
  void place_paths(double t) {
    m_t_base = t;
    m_is_placed = true;
    const Ray& ray = m_job->ray;
    const Vec3d p = ray.at(t);
    for (size_t g = 0; g < m_grids.size(); ++g) {
      const Affine& local = m_scene.grids[g].local_from_world;
      m_paths[g] = LinePath(local.point(p), local.direction(ray.d));
    }
    for (size_t i = 0; i < m_lattices.size(); ++i) {
      const Affine& lattice = m_scene.lattices[i].lattice_from_world;
      m_sun_paths[i] = LinePath(lattice.point(p), lattice.direction(ray.d));
    }
    m_height0 = float(m_job->height0 + t * m_job->height1);
    m_height1 = float(m_job->height1);
  }

  void walk_one(GridWalk walk) {
    const double extinction = walk.extinction(), scale = light_scale(m_scene.grids[0]);
    while (walk.next()) {
      const ValueRange& range = m_scene.is_leaping ? walk.now.range : walk.whole();
      if (range.hi == 0.0f) {
        ++m_leaps;
        continue;
      }
      const double sigma = extinction * double(range.hi), variation = scale * double(range.hi - range.lo);
      if (!add_stretch(walk.now.t0, walk.now.t1, sigma, variation, walk.voxel())) return;
    }
  }

  /// How much a density adds to a ray, relative to the brightest it can get [1/m]: by its extinction, or by
  /// what it glows.
  double light_scale(const MarchGrid& grid) const {
    if (!(grid.glow > grid.extinction * m_job->brightest)) return grid.extinction;
    return grid.glow / std::max(m_job->brightest, 1e-30);
  }

  /// Several grids: stretches end where those of any grid end.
  void walk_all(const MarchRay& job) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    std::vector<GridWalk> walks;
    std::vector<double> scales;
    double t = kNever;
    for (const MarchGrid& grid : m_scene.grids) {
      const Ray local = local_ray(grid, job.ray);
      walks.emplace_back(grid, local, clip_to_bounds(grid.bounds, local, job.segment));
      scales.push_back(light_scale(grid));
      t = std::min(t, walks.back().now.t0);
    }
    while (t < kNever) {
      double end = kNever, sigma = 0.0, variation = 0.0, voxel = kNever;
      bool is_empty = true;
      for (size_t g = 0; g < walks.size(); ++g) {
        GridWalk& walk = walks[g];
        walk.pass(t);
        const bool has_begun = walk.now.t0 <= t;
        end = std::min(end, has_begun ? walk.now.t1 : walk.now.t0);
        if (!m_scene.is_leaping && has_begun) walk.now.range = walk.whole();
        if (!has_begun || walk.now.range.hi == 0.0f) continue;
        is_empty = false;
        sigma += walk.extinction() * double(walk.now.range.hi);
        variation += scales[g] * double(walk.now.range.hi - walk.now.range.lo);
        voxel = std::min(voxel, walk.voxel());
      }
      if (end == kNever) return;
      if (is_empty) {
        ++m_leaps;
      } else if (!add_stretch(t, end, sigma, variation, voxel)) {
        return;
      }
      t = end;
    }
  }

  /// Queues the samples of a stretch; false once the ray has ended. Two rules give the step: the density may
  /// vary so much, and the light inside a step may fall by so much, that the step errs by its share (METHODS
  /// §1.5, §9.2); both matter less behind what the ray has already met.
  bool add_stretch(double t0, double t1, double sigma, double variation, double voxel) {
    if (!m_is_placed) {
      place_paths(t0);
      m_first.t0 = t0;
    }
    const double span = t1 - t0;
    const double weight = m_transmittance / m_job->step_quality;
    const double rate2 = std::max(weight * variation / voxel, weight * sigma * sigma);
    const double finest = std::min(std::sqrt(rate2), 8.0 / voxel);
    const int steps = std::max(1, int(std::ceil(span * finest)));
    const D d;
    const float dt = float(span / steps), first = float(t0 - m_t_base);
    const V lane = hn::Iota(d, 0.5f);
    for (int done = 0; done < steps;) {
      const int room = int(kQueue - kLanes - m_queued), count = std::min(room, steps - done);
      for (int i = 0; i < count; i += int(kLanes)) {
        const V at = hn::Add(lane, hn::Set(d, float(done + i)));
        hn::StoreU(hn::MulAdd(at, hn::Set(d, dt), hn::Set(d, first)), d, m_t + m_queued + i);
        hn::StoreU(hn::Set(d, dt), d, m_dt + m_queued + i);
      }
      m_queued += size_t(count);
      done += count;
      if (!drain()) return false;
    }
    return true;
  }

  /// Works off full vectors and keeps the rest for later.
  bool drain() {
    const D d;
    size_t done = 0;
    for (; done + kLanes <= m_queued; done += kLanes) {
      composite(m_t + done, m_dt + done);
      m_samples += kLanes;
      if (m_transmittance <= m_job->stop) {
        m_queued = 0;
        return false;
      }
    }
    if (done > 0) {
      hn::StoreU(hn::LoadU(d, m_t + done), d, m_t);
      hn::StoreU(hn::LoadU(d, m_dt + done), d, m_dt);
      m_queued -= done;
    }
    return true;
  }

  /// One vector of samples, in order along the ray.
  HWY_INLINE void composite(const float* t_at, const float* dt_at) {
    const D d;
    const V t = hn::LoadU(d, t_at), dt = hn::LoadU(d, dt_at);
    if constexpr (kGrids == 1) {
      const V rho = density(0, t), sigma = hn::Mul(rho, hn::Set(d, m_extinctions[0]));
      if (!m_has_met) find_first(rho, t_at);
      const V tau = hn::Mul(sigma, dt), opacity = simd_opacity(d, tau);
      const V before = transmittance_before(opacity, t_at, dt_at);
      add_to(m_tau, tau);
      const V scattered = hn::Mul(before, opacity);
      const V response = add_scattered(0, scattered, t);
      const MarchGrid& grid = m_scene.grids[0];
      const V lit = hn::MulAdd(rho, hn::Set(d, float(grid.glow)), hn::Mul(sigma, response));
      add_error(lit, sigma, response, hn::Mul(before, dt));
    } else {
      composite_several(t_at, dt_at, t, dt);
    }
  }

  /// Where grids overlap their extinctions add up, and each scatters its share.
  void composite_several(const float* t_at, const float* dt_at, V t, V dt) {
    const D d;
    V sigma = hn::Zero(d), rho_sum = hn::Zero(d);
    for (int g = 0; g < grids(); ++g) {
      const V rho = density(g, t);
      hn::StoreU(rho, d, m_rhos.data() + size_t(g) * kLanes);
      sigma = hn::MulAdd(rho, hn::Set(d, m_extinctions[size_t(g)]), sigma);
      rho_sum = hn::Add(rho_sum, rho);
    }
    if (!m_has_met) find_first(rho_sum, t_at);
    const V tau = hn::Mul(sigma, dt), opacity = simd_opacity(d, tau);
    const V before = transmittance_before(opacity, t_at, dt_at);
    add_to(m_tau, tau);
    // Mean transmittance over a step: before * (1 - exp(-tau)) / tau.
    const V thin = hn::Set(d, 1e-12f);
    const V share = hn::IfThenElse(hn::Gt(tau, thin), hn::Div(opacity, hn::Max(tau, thin)), hn::Set(d, 1.0f));
    const V mean = hn::Mul(hn::Mul(before, share), dt);
    V lit = hn::Zero(d), glow = hn::Zero(d);
    for (int g = 0; g < grids(); ++g) {
      const V rho = hn::LoadU(d, m_rhos.data() + size_t(g) * kLanes), column = hn::Mul(mean, rho);
      add_to(sums_of(g), column);
      const V extinction = hn::Set(d, m_extinctions[size_t(g)]);
      lit = hn::MulAdd(hn::Mul(rho, extinction), add_scattered(g, hn::Mul(column, extinction), t), lit);
      glow = hn::MulAdd(rho, hn::Set(d, float(m_scene.grids[size_t(g)].glow)), glow);
    }
    const V bright = hn::Div(lit, hn::Max(sigma, hn::Set(d, 1e-30f)));
    add_error(hn::Add(lit, glow), sigma, bright, hn::Mul(before, dt));
  }

  HWY_INLINE V density(int grid, V t) const {
    const LinePath& path = m_paths[size_t(grid)];
    return m_grids[size_t(grid)].template read<kClamp>(path.at(0, t), path.at(1, t), path.at(2, t));
  }

  /// Adds what a grid scatters of each light and of the height-dependent sky; returns its response to all
  /// lights.
  HWY_INLINE V add_scattered(int grid, V scattered, V t) {
    const D d;
    V sum = hn::Zero(d);
    for (int l = 0; l < lights(); ++l) {
      const V response = response_of(grid, l, sun_depth(l, t));
      add_to(sums_of(grid) + size_t(2 + l) * kLanes, hn::Mul(scattered, response));
      sum = hn::Add(sum, response);
    }
    if constexpr (!kPlain) {
      const V mix = hn::MulAdd(t, hn::Set(d, m_height1), hn::Set(d, m_height0));
      add_to(sums_of(grid) + kLanes, hn::Mul(scattered, mix));
    }
    return sum;
  }

  float* sums_of(int grid) { return m_accumulators.data() + size_t(grid) * sums_per_grid(m_scene) * kLanes; }

  static HWY_INLINE void add_to(float* sum, V value) {
    const D d;
    hn::StoreU(hn::Add(hn::LoadU(d, sum), value), d, sum);
  }

  HWY_INLINE V sun_depth(int light, V t) {
    if constexpr (kGrids != 1) {
      if (m_scene.shadow_step > 0.0) return traced_depth(light, t);
    }
    const size_t first = size_t(light) * size_t(grids());
    V sum = m_lattices[first].read(m_sun_paths[first], t);
    for (int g = 1; g < grids(); ++g) {
      sum = hn::Add(sum, m_lattices[first + size_t(g)].read(m_sun_paths[first + size_t(g)], t));
    }
    return sum;
  }

  /// Shadow rays of all lanes in step, through every grid.
  V traced_depth(int light, V t) {
    const D d;
    V sum = hn::Zero(d);
    for (int g = 0; g < grids(); ++g) {
      if (m_extinctions[size_t(g)] > 0.0f) sum = hn::Add(sum, traced_depth(light, g, t));
    }
    return sum;
  }

  V traced_depth(int light, int grid, V t) {
    const D d;
    const MarchGrid& scene = m_scene.grids[size_t(grid)];
    const Vec3d towards = scene.local_from_world.direction(m_scene.towards_suns[size_t(light)]);
    const double ds = m_scene.shadow_step / length(towards);  // [m]
    V p[3], step[3];
    V most = hn::Set(d, std::numeric_limits<float>::max());  // steps until a lane leaves the grid
    for (int axis = 0; axis < 3; ++axis) {
      const float per_step = float(towards[axis] * ds);
      p[axis] = m_paths[size_t(grid)].at(axis, t);
      step[axis] = hn::Set(d, per_step);
      if (per_step == 0.0f) continue;
      const V exit = hn::Set(d, float(per_step > 0.0f ? scene.bounds.max[axis] : scene.bounds.min[axis]));
      most = hn::Min(most, hn::Div(hn::Sub(exit, p[axis]), step[axis]));
    }
    const float scale = float(scene.extinction * ds);
    const V enough = hn::Set(d, float(m_scene.enough_shadow) / scale);
    const int count = int(std::min(hn::GetLane(hn::MaxOfLanes(d, most)), 1e7f)) + 1;
    V sum = hn::Zero(d);
    int k = 0;
    for (; k < count; ++k) {
      const V at = hn::Set(d, float(k) + 0.5f);
      sum = hn::Add(sum, m_grids[size_t(grid)].read_or_skip(hn::MulAdd(at, step[0], p[0]),
                                                            hn::MulAdd(at, step[1], p[1]),
                                                            hn::MulAdd(at, step[2], p[2])));
      if (k % 8 == 7 && hn::AllTrue(d, hn::Ge(sum, enough))) break;
    }
    m_lookups += uint64_t(k) * kLanes;
    return hn::Mul(sum, hn::Set(d, scale));
  }

  HWY_INLINE V response_of(int grid, int light, V tau) const {
    const D d;
    const float* weights = m_job->weights + (size_t(grid) * size_t(lights()) + size_t(light)) * kMostTerms;
    if constexpr (kPlain) {
      return hn::Mul(hn::Set(d, weights[0]), simd_transmittance(d, tau));
    } else {
      const MarchGrid& terms = m_scene.grids[size_t(grid)];
      V sum = hn::Zero(d);
      for (int k = 0; k < terms.terms; ++k) {
        const V extinction = hn::Set(d, terms.term_extinction[size_t(k)]);
        sum = hn::MulAdd(hn::Set(d, weights[k]), simd_transmittance(d, hn::Mul(extinction, tau)), sum);
      }
      return sum;
    }
  }

  /// Transmittance in front of each lane. Over a vector the product of floats is good to a few ulp; from
  /// vector to vector it goes on in double (METHODS §1.4).
  HWY_INLINE V transmittance_before(V opacity, const float* t, const float* dt) {
    const D d;
    const V passed = m_lanes.rotate(m_lanes.running_product(hn::Sub(hn::Set(d, 1.0f), opacity)), 0);
    const V before = hn::Mul(hn::Set(d, float(m_transmittance)), m_lanes.shift(passed, hn::Set(d, 1.0f), 0));
    const double after = m_transmittance * double(hn::GetLane(passed));
    if (m_transmittance >= 0.5 && after < 0.5) find_half(before, opacity, t, dt);
    m_transmittance = after;
    return before;
  }

  /// Inside its step the density is taken as constant.
  void find_half(V before, V opacity, const float* t, const float* dt) {
    const D d;
    alignas(64) float passed[kLanes], stopped[kLanes];
    hn::Store(before, d, passed);
    hn::Store(opacity, d, stopped);
    size_t i = kLanes - 1;
    while (i > 0 && passed[i] < 0.5f) --i;
    const double depth = -std::log1p(-double(stopped[i])), wanted = std::log(2.0 * double(passed[i]));
    const double share = depth > 0.0 ? std::clamp(wanted / depth, 0.0, 1.0) : 0.5;
    m_z_half = m_t_base + double(t[i]) + (share - 0.5) * double(dt[i]);
  }

  /// Looks for the first density on the ray, between two samples.
  void find_first(V rho, const float* t) {
    alignas(64) float rhos[kLanes];
    hn::Store(rho, D(), rhos);
    for (size_t i = 0; i < kLanes; ++i) {
      const double here = m_t_base + double(t[i]);
      if (rhos[i] > 0.0f) {
        m_first.t1 = here;
        m_has_met = true;
        return;
      }
      m_first.t0 = here;
    }
  }

  /// The error of the midpoint rule is h^2/24 of the second derivative: differences of neighbouring samples
  /// measure it, in the lit density and, for the effect of a wrong optical depth on what lies behind, in the
  /// density. Errors of different steps are added like independent ones.
  HWY_INLINE void add_error(V lit, V sigma, V bright, V weight) {
    const D d;
    const V brightest = hn::Max(bright, hn::Set(d, float(m_job->behind)));
    const V e_lit = second_difference(m_lit, lit), e_sigma = second_difference(m_sigma, sigma);
    const V e = hn::Mul(m_weight.push(m_lanes, weight),
                        hn::MulAdd(m_bright.push(m_lanes, brightest), e_sigma, e_lit));
    hn::Store(hn::MulAdd(e, e, hn::Load(d, m_error2)), d, m_error2);
  }

  /// Of the sample before each lane and its two neighbours.
  HWY_INLINE V second_difference(SampleHistory& history, V now) const {
    V middle, first;
    history.push(m_lanes, now, middle, first);
    return hn::Abs(hn::Sub(hn::Add(first, now), hn::Add(middle, middle)));
  }

  void finish(MarchResult& result, double* sums) {
    if (m_queued > 0) composite_rest();
    result.tau = double(sum_of(m_tau));
    result.transmittance = m_transmittance;
    result.error = std::sqrt(double(sum_of(m_error2))) / 24.0;
    result.first = m_first;
    result.z_half = m_z_half;
    result.samples = m_samples;
    result.lookups = m_scene.shadow_step > 0.0 ? m_lookups : m_samples * uint64_t(lights());
    result.leaps = m_leaps;
    const size_t count = m_grids.size() * sums_per_grid(m_scene);
    for (size_t i = 0; i < count; ++i) sums[i] = double(sum_of(m_accumulators.data() + i * kLanes));
    // A grid alone scatters all that does not pass.
    if constexpr (kGrids == 1) sums[0] = opacity_from_tau(result.tau) / m_scene.grids[0].extinction;
  }

  /// The last samples, with steps of length 0 behind them.
  void composite_rest() {
    for (size_t i = m_queued; i < kLanes; ++i) m_t[i] = m_t[m_queued - 1], m_dt[i] = 0.0f;
    composite(m_t, m_dt);
    m_samples += m_queued;
    m_queued = 0;
  }

  static float sum_of(const float* lanes) {
    const D d;
    return hn::GetLane(hn::SumOfLanes(d, hn::LoadU(d, lanes)));
  }

  static constexpr size_t kQueue = 256;

  const MarchScene& m_scene;
  std::vector<GridReader> m_grids;
  std::vector<LatticeReader> m_lattices;
  std::vector<LinePath> m_paths, m_sun_paths;
  std::vector<float> m_extinctions;   ///< of each grid [1/m]
  std::vector<float> m_rhos;          ///< [grid][lane]: densities of the present vector
  std::vector<float> m_accumulators;  ///< [grid][sum][lane]
  const MarchRay* m_job = nullptr;
  bool m_is_placed = false;
  double m_t_base = 0.0, m_transmittance = 1.0, m_z_half = 0.0;
  Segment m_first;         ///< see MarchResult
  bool m_has_met = false;  ///< some density
  float m_height0 = 0.0f, m_height1 = 0.0f;
  size_t m_queued = 0;
  uint64_t m_samples = 0, m_lookups = 0, m_leaps = 0;
  alignas(64) float m_tau[kLanes], m_error2[kLanes];
  alignas(64) float m_t[kQueue + kLanes], m_dt[kQueue + kLanes];
  LaneShifter m_lanes;
  SampleHistory m_lit, m_sigma, m_bright, m_weight;
};

template <int kGrids, int kLights, bool kPlain>
void march_with(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
                std::span<double> sums) {
  Marcher<kGrids, kLights, kPlain> marcher(scene);
  const size_t stride = scene.grids.size() * sums_per_grid(scene);
  const bool misses_all = std::all_of(scene.grids.begin(), scene.grids.end(), [&](const MarchGrid& grid) {
    return Beam(grid, rays).misses(grid.bounds);
  });
  for (size_t i = 0; i < rays.size(); ++i) {
    double* const own = sums.data() + i * stride;
    misses_all ? marcher.miss(results[i], own) : marcher.march(rays[i], results[i], own);
  }
}

/// Chooses the loop that has what the scene calls for and no more.
void march_rays_impl(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
                     std::span<double> sums) {
  const bool is_plain = !scene.several_terms && !scene.height_light;
  const bool is_simple =
      scene.grids.size() == 1 && scene.grids[0].extinction > 0.0 && !(scene.shadow_step > 0.0);
  if constexpr (kHasSeveralMedia) {
    if (!is_simple) return march_with<0, -1, false>(scene, rays, results, sums);
  }
  if (!is_plain) return march_with<1, -1, false>(scene, rays, results, sums);
  if constexpr (kHasShadows) {
    if (scene.lights == 1) return march_with<1, 1, true>(scene, rays, results, sums);
    if (scene.lights > 1) return march_with<1, -1, true>(scene, rays, results, sums);
  }
  march_with<1, 0, true>(scene, rays, results, sums);
}

/// Optical depth of every piece between neighbouring nodes of one line, then summed from the sun's side.
void sweep_line(const SunSweep& sweep, const GridReader& reader, const Vec3d& start,
                std::vector<float>& pieces, float* tau) {
  const int nodes = sweep.size.z, count = (nodes - 1) * sweep.steps;
  std::fill(pieces.begin(), pieces.end(), 0.0f);
  const Ray ray{start, sweep.ew};
  const D d;
  const LinePath path(start, sweep.ew);
  const float scale = float(sweep.grid->extinction * sweep.length / sweep.steps);
  NodeWalker walker(*sweep.grid->pyramid, ray,
                    clip_to_bounds(sweep.grid->bounds, ray, {0.0, double(nodes - 1)}));
  NodeWalker::Stretch stretch;
  const V per_step = hn::Set(d, 1.0f / float(sweep.steps));
  int done = 0;
  while (walker.next(stretch)) {
    if (stretch.range.hi == 0.0f) continue;
    const int first = std::max(done, int(stretch.t0 * sweep.steps - 0.5)),
              last = std::min(count, int(stretch.t1 * sweep.steps + 0.5));
    // A whole vector may reach beyond the stretch: what it reads there is right, too.
    int k = first;
    for (; k < last; k += int(kLanes)) {
      const V w = hn::Mul(hn::Add(hn::Iota(d, 0.5f), hn::Set(d, float(k))), per_step);
      const V rho = reader.template read<true>(path.at(0, w), path.at(1, w), path.at(2, w));
      hn::StoreU(hn::Mul(rho, hn::Set(d, scale)), d, pieces.data() + k);
    }
    done = std::max(done, std::min(k, count));
  }
  if (done == 0) {
    std::fill_n(tau, nodes, 0.0f);
    return;
  }
  std::fill(pieces.begin() + done, pieces.end(), 0.0f);
  float sum = 0.0f;
  tau[nodes - 1] = 0.0f;
  for (int w = nodes - 2, k = count - 1; w >= 0; --w) {
    for (int step = 0; step < sweep.steps; ++step, --k) sum += pieces[size_t(k)];
    tau[w] = sum;
  }
}

void sweep_sun_rows_impl(const SunSweep& sweep, int u0, int u1, float* tau) {
  const GridReader reader(*sweep.grid->pyramid);
  std::vector<float> pieces(size_t(sweep.size.z * sweep.steps) + kLanes);
  for (int u = u0; u < u1; ++u) {
    for (int v = 0; v < sweep.size.y; ++v) {
      const Vec3d start = sweep.origin + double(u) * sweep.eu + double(v) * sweep.ev;
      sweep_line(sweep, reader, start, pieces,
                 tau + (size_t(u - u0) * size_t(sweep.size.y) + size_t(v)) * size_t(sweep.size.z));
    }
  }
}

const char* target_impl() {
  return hwy::TargetName(HWY_TARGET);
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pileus {

HWY_EXPORT(march_rays_impl);
HWY_EXPORT(sweep_sun_rows_impl);
HWY_EXPORT(target_impl);

void march_rays(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
                std::span<double> sums) {
  HWY_DYNAMIC_DISPATCH(march_rays_impl)(scene, rays, results, sums);
}

void sweep_sun_rows(const SunSweep& sweep, int u0, int u1, float* tau) {
  HWY_DYNAMIC_DISPATCH(sweep_sun_rows_impl)(sweep, u0, u1, tau);
}

const char* march_target() {
  return HWY_DYNAMIC_DISPATCH(target_impl)();
}

}  // namespace pileus
#endif
