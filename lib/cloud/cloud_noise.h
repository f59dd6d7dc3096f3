#pragma once

#include <span>
#include <vector>

#include "lib/cloud/cloud_recipe.h"
#include "lib/freeform/local_form.h"
#include "lib/math/interval.h"
#include "lib/math/vec.h"
#include "lib/noise/fbm.h"
#include "lib/noise/octave_sum.h"

namespace pileus {

/// The noise of a cloud: n(p), 0 .. 1, from a sum of octaves s(q) at q = (p - offset) / stretch:
///   billow  n = min(1, s),  fbm  n = clamp(1/2 + s),  ridged  n = s
/// where Fbm gives s and its warp. n rises with s, so that bounds of the sum are bounds of n, and octaves
/// that are still missing bound what it can become. threads: const, safe from many threads
class CloudNoise {
 public:
  /// frequency: of the first octave [1/m], in the place of the recipe's
  CloudNoise(const CloudNoiseRecipe& recipe, double frequency);

  /// n at a point of world space.
  double value(const Vec3d& p_world) const { return level(sum(p_world)); }

  /// Bounds of n over a box, for what octave_sums gives too.
  Interval range(const Box3d& box_world) const;

  // The sum bit by bit.

  size_t octaves() const { return m_fbm.octaves().size(); }

  /// A box that holds the places where the octaves are read for points of a box of world space.
  Box3d pattern_box(const Box3d& box_world) const;

  /// Bounds of octave i where it is read in a box of the pattern.
  Interval octave_range(size_t i, const Box3d& pattern_box) const;

  /// Bounds of all octaves from i on, anywhere. They hold 0.
  const Interval& rest(size_t i) const { return m_rests[i]; }

  /// Puts octaves [first, last) at the points of a lattice into `sums`, in single precision.
  void octave_sums(size_t first, size_t last, const PointLattice& points, std::span<float> sums) const;

  /// n for a whole sum.
  template <class T>
  T level(T sum) const {
    const T shifted = sum + T(m_base);
    return shifted < T(0) ? T(0) : shifted > T(1) ? T(1) : shifted;
  }
  Interval level(const Interval& sum) const { return {level(sum.lo), level(sum.hi)}; }

 private:
  double sum(const Vec3d& p_world) const { return m_fbm.value(m_kind, pattern_point(p_world)); }
  Vec3d pattern_point(const Vec3d& p_world) const { return (p_world - m_offset) / m_stretch; }  ///< q

  /// Octaves at the points of a lattice, none of it stretched, moved or warped.
  void lattice_sums(OctaveSum kind, std::span<const NoiseOctave> octaves, const PointLattice& points,
                    std::span<float> sums) const;
  std::vector<Vec3d> warped_points(const PointLattice& still) const;

  OctaveSum m_kind;
  Fbm m_fbm;
  std::vector<Interval> m_rests;
  double m_base;
  Vec3d m_offset, m_stretch;
};

}  // namespace pileus
