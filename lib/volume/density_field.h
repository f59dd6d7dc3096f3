#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "lib/math/ray.h"
#include "lib/math/vec.h"

namespace pileus {

class Affine;
class BrickGrid;
class BrickPyramid;

/// The density on one stretch of a ray, as a cubic in Bernstein form over [t0, t1] or as an exponential.
/// Inside a cell of a trilinear field the density along a ray *is* a cubic, so nothing is approximated; the
/// Bernstein form keeps every sum free of cancellation (METHODS §9.1), because densities and hence control
/// values are >= 0.
struct DensityPiece {
  double t0 = 0.0, t1 = 0.0;    ///< [m], t0 <= t1
  std::array<double, 4> rho{};  ///< control values; for an exponential rho[0] is the density at t0
  double rate = 0.0;            ///< [1/m]; not 0: rho(t) = rho[0] * exp(rate * (t - t0))
};

/// rho at t in [t0, t1].
double density_at(const DensityPiece& piece, double t);

/// Integral of rho from piece.t0 to t [m]; t in [t0, t1].
double column_to(const DensityPiece& piece, double t);

/// Work done by a field, for the render report. One per tile, summed at the end.
struct FieldCounters {
  uint64_t density_samples = 0;  ///< look-ups of an interpolated density or of a cell's corner values
  uint64_t leaps = 0;            ///< empty nodes skipped
};

/// A dimensionless density rho >= 0 in world space: what the renderer sees of a `.vdb` grid, a built cloud or
/// an analytic medium. Immutable; all calls are const and safe from many threads. Virtual calls happen per
/// ray, never per sample. Outside bounds() the density is 0.
class DensityField {
 public:
  virtual ~DensityField() = default;

  /// World-space box that holds every point with rho > 0 [m]. May be infinite.
  virtual Box3d bounds() const = 0;

  /// Upper bound of rho.
  virtual double max_density() const = 0;

  /// Size of the finest feature [m]: the smallest voxel edge of a grid, infinity where the field is smooth.
  virtual double feature_size() const = 0;

  /// Appends the non-zero pieces of rho along the ray within the segment, ordered, disjoint, exact up to
  /// rounding. Here and below, t counts in lengths of the ray's d, which may have any length but 0.
  virtual void append_pieces(const Ray& ray, Segment segment, std::vector<DensityPiece>& pieces,
                             FieldCounters& counters) const = 0;

  /// Integral of rho over the segment [m] in closed form, cell by cell; may stop early and return any value
  /// >= enough once it has passed `enough`.
  virtual double column(const Ray& ray, Segment segment, double enough, FieldCounters& counters) const = 0;

  /// rho[i] = density at t = t0 + i * dt, for every i: what an equidistant marcher reads.
  virtual void sample(const Ray& ray, double t0, double dt, std::span<double> rho,
                      FieldCounters& counters) const = 0;

  /// True where voxels stand behind the field.
  virtual bool has_bricks() const { return false; }

  /// These voxels in bricks; null where there are none. Made when first asked for.
  /// errors: those of build_brick_grid
  virtual const BrickGrid* bricks() const { return nullptr; }

  /// The same in 16 bits, for those who march through them; null where there are none, or where their values
  /// do not go into 16 bits at all. Made when first asked for, too.
  /// errors: those of build_quantized_bricks
  virtual std::shared_ptr<const BrickPyramid> quantized_bricks() const { return nullptr; }

  /// Where world points lie in the bricks; where these stand in several places, in the first of them. Only
  /// for fields that have bricks.
  virtual const Affine& index_from_world() const;

  /// The same for each of the places; the density is the sum over them. None where there are no bricks.
  virtual std::span<const Affine> places() const;
};

}  // namespace pileus
