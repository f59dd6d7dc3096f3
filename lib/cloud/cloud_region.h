#pragma once

#include <cstdint>
#include <span>

#include "lib/cloud/procedural_cloud.h"
#include "lib/freeform/local_form.h"
#include "lib/math/interval.h"
#include "lib/math/vec.h"

namespace pileus {

/// A cloud in a box: what the density can be there, and the fast way to the density at many points.
/// threads: const calls are safe from many threads; the cloud must outlive it
class CloudRegion {
 public:
  CloudRegion(const ProceduralCloud& cloud, const Box3d& box_world)
      : CloudRegion(cloud, cloud.m_shape.form().within(cloud.m_shape.form_box(box_world)), box_world) {}

  /// The cloud in a part of the box: cheaper than from the whole cloud.
  CloudRegion within(const Box3d& part_world) const {
    return {*m_cloud, m_form.within(m_cloud->m_shape.form_box(part_world)), part_world};
  }

  /// Bounds of the density in the box, for those of density() and densities().
  const Interval& range() const { return m_range; }

  /// True where the density is 0 in the whole box.
  bool is_empty() const { return m_range.hi == 0; }

  /// True where it is 1 in the whole box.
  bool is_full() const { return m_range.lo == 1; }

  static constexpr size_t kMaxPoints = 512;  ///< of a block: 8^3

  /// The density at points of the box, in single precision.
  ///   rho: points.size(), as PointLattice lays them out
  /// returns: at how many points noise was computed, once for each part of its octaves
  int64_t densities(const PointLattice& points, std::span<float> rho) const;

 private:
  CloudRegion(const ProceduralCloud& cloud, CloudBody::Local form, const Box3d& box_world);

  /// Bounds of the noise, no tighter than they matter.
  Interval frayed_range(const Interval& coverage, const Box3d& box_world) const;

  void form_values(const PointLattice& points, std::span<float> f) const;

  /// Times what comes after the noise.
  void apply_factors(const PointLattice& points, std::span<float> rho) const;

  const ProceduralCloud* m_cloud;
  CloudBody::Local m_form;
  Interval m_range;
};

}  // namespace pileus
