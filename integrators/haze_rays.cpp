#include "integrators/haze_rays.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "lib/math/box.h"
#include "lib/math/box_shadow.h"
#include "lib/math/roots.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What rounding may change of optical depths, in units of what interpolation may.
constexpr double kRounding = 5.0;

/// Nodes between `from` and `to`, as many as linear interpolation asks for, are put behind `from`; `to` too.
void refine(const std::function<double(double)>& depth_at, HazeDepth from, HazeDepth to, double allowed,
            int most_halvings, std::vector<HazeDepth>& nodes) {
  const double t_middle = 0.5 * (from.t + to.t);
  if (!(t_middle > from.t && t_middle < to.t)) return nodes.push_back(to);
  const HazeDepth middle{t_middle, depth_at(t_middle)};
  const auto errs_at = [&](double share) {
    const double t = from.t + share * (to.t - from.t);
    const HazeDepth &a = t < t_middle ? from : middle, &b = t < t_middle ? middle : to;
    return std::abs(a.depth + (t - a.t) / (b.t - a.t) * (b.depth - a.depth) - depth_at(t)) > allowed;
  };
  // Halves of a parabola err by a quarter of this: there is no need to look where they would by twice of what
  // is allowed. Both are looked into, beside their middles: a bend, where the way to the sun changes from one
  // face of a box to another, would be overlooked.
  constexpr double kTooBent = 8.0;
  const bool is_too_bent = std::abs(0.5 * (from.depth + to.depth) - middle.depth) > kTooBent * allowed;
  if (most_halvings > 0 && (is_too_bent || errs_at(0.19) || errs_at(0.83))) {
    refine(depth_at, from, middle, allowed, most_halvings - 1, nodes);
    refine(depth_at, middle, to, allowed, most_halvings - 1, nodes);
  } else {
    nodes.insert(nodes.end(), {middle, to});
  }
}

/// Where a ray may be in the shadow of a box: where a ball around it shades it. Appends ends and some points
/// between, so that no shadow falls between two nodes.
void append_shadow(const Ray& ray, const Vec3d& towards_sun, const Box3d& box, std::vector<double>& t) {
  constexpr int kParts = 8;
  const Vec3d f = ray.o - box.center(), radii = 0.5 * box.size();
  const Vec3d across = f - dot(f, towards_sun) * towards_sun,
              d = ray.d - dot(ray.d, towards_sun) * towards_sun;
  const auto ends = quadratic_roots(dot(d, d), 2.0 * dot(across, d), dot(across, across) - dot(radii, radii));
  if (ends.count < 2) return;
  const auto [first, last] = ends.t;
  for (int part = 0; part <= kParts; ++part) t.push_back(first + double(part) / kParts * (last - first));
}

}  // namespace

HazeRays::HazeRays(std::span<const WorldMedium* const> hazes, std::span<const Box3d> grids,
                   std::span<const Illumination> suns, const Box3d& bounds, double depth_error)
    : m_hazes(hazes.begin(), hazes.end()),
      m_grids(grids.begin(), grids.end()),
      m_suns(suns.begin(), suns.end()),
      m_bounds(bounds),
      m_depth_error(depth_error) {}

void HazeRays::place(MarchRay& job, OnRay& own) const {
  own.stretches.assign(m_hazes.size(), {});
  own.depths.assign(m_suns.size(), {});
  own.is_readable = true;
  double tau = 0.0;
  for (size_t h = 0; h < m_hazes.size(); ++h)
    own.is_readable &= find_stretch(*m_hazes[h], job, own.stretches[h], tau);
  own.depth_error = m_depth_error / opacity(job, tau);
  if (own.is_readable) {
    for (size_t sun = 0; sun < m_suns.size(); ++sun) fill_depths(sun, job, own);
  } else {
    own.stretches.assign(m_hazes.size(), {});
  }
  job.grid_shadows = grid_shadows(job.ray, clip_to_box(job.ray, job.segment, m_bounds));
  job.hazes = own.stretches.data();
  job.haze_depths = own.depths.data();
}

/// Where on a ray grids may hide a sun, or are.
Segment HazeRays::grid_shadows(const Ray& ray, Segment segment) const {
  Segment hull{kInfinity, 0.0};
  for (const Box3d& grid : m_grids) {
    for (const Illumination& sun : m_suns) {
      const Segment shadow = shadow_of_box(ray, segment, sun.wi, grid);
      if (!shadow.empty()) hull = {std::min(hull.t0, shadow.t0), std::max(hull.t1, shadow.t1)};
    }
  }
  return hull;
}

/// Upper bound of how much of a ray's end is covered, where its hazes have the optical depth `tau`; not far
/// below what hazes show.
double HazeRays::opacity(const MarchRay& job, double tau) const {
  constexpr double kLeast = 1.0 / 64.0;
  const bool meets_grid = std::any_of(m_grids.begin(), m_grids.end(), [&](const Box3d& grid) {
    return !clip_to_box(job.ray, job.segment, grid).empty();
  });
  return meets_grid ? 1.0 : std::max(-std::expm1(-tau), kLeast);
}

/// Adds the optical depth of the stretch to `tau`.
bool HazeRays::find_stretch(const WorldMedium& haze, const MarchRay& job, HazeStretch& stretch,
                            double& tau) const {
  thread_local std::vector<DensityPiece> pieces;
  FieldCounters counters;
  pieces.clear();
  haze.density->append_pieces(job.ray, job.segment, pieces, counters);
  if (pieces.empty()) return true;
  const DensityPiece& piece = pieces.front();
  const bool is_constant =
      std::all_of(piece.rho.begin(), piece.rho.end(), [&](double rho) { return rho == piece.rho[0]; });
  if (pieces.size() > 1 || (piece.rate == 0.0 && !is_constant)) return false;
  const Segment inside{piece.t0, piece.t1};
  tau += haze.extinction * column_to(piece, piece.t1);
  stretch = {inside, density_at(piece, piece.rate > 0.0 ? inside.t1 : inside.t0), piece.rate};
  // Kernels know where they are in single precision.
  const double rounding =
      inside.t0 * double(std::numeric_limits<float>::epsilon()) * haze.extinction * stretch.densest;
  return rounding <= kRounding * m_depth_error;
}

void HazeRays::fill_depths(size_t sun, const MarchRay& job, OnRay& own) const {
  constexpr int kMostHalvings = 14;
  thread_local std::vector<HazeDepth> nodes;
  thread_local std::vector<double> ends;
  const Segment range = clip_to_box(job.ray, job.segment, m_bounds);
  if (range.empty()) return;
  const auto depth_at = [&](double t) { return depth(sun, job.ray.at(t)); };
  // The depth bends where the ray enters and leaves a haze.
  ends = {range.t0, range.t1};
  for (const HazeStretch& stretch : own.stretches)
    ends.insert(ends.end(), {stretch.inside.t0, stretch.inside.t1});
  for (const WorldMedium* haze : m_hazes)
    append_shadow(job.ray, m_suns[sun].wi, haze->density->bounds(), ends);
  std::erase_if(ends, [&](double t) { return !(t >= range.t0 && t <= range.t1); });
  std::sort(ends.begin(), ends.end());
  nodes.assign(1, {range.t0, depth_at(range.t0)});
  for (size_t i = 1; i < ends.size(); ++i) {
    if (!(ends[i] > nodes.back().t)) continue;
    refine(depth_at, nodes.back(), {ends[i], depth_at(ends[i])}, own.depth_error, kMostHalvings, nodes);
  }
  own.depths[sun].assign(nodes.begin(), nodes.end());
}

double HazeRays::depth(size_t sun, const Vec3d& p) const {
  FieldCounters counters;
  double tau = 0.0;
  for (const WorldMedium* haze : m_hazes) {
    if (!(haze->extinction > 0.0)) continue;
    tau +=
        haze->extinction * haze->density->column({p, m_suns[sun].wi}, {0.0, kInfinity}, kInfinity, counters);
  }
  return tau;
}

}  // namespace pileus
