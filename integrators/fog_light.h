#pragma once

#include <utility>
#include <vector>

#include "integrators/part_integrals.h"
#include "integrators/ray_fog.h"

namespace pileus {

/// The light that the fog sends from in front of the points of a ray, enclosed: closed form where it has one,
/// else the sum of proven ranges of its growth, stretch by stretch. Keeps its memory between rays.
class FogLight {
 public:
  /// Forgets the ray before.
  ///   fog:    of the new one; null: none
  ///   narrow: what the range of one stretch may be off
  void build(const RayFog* fog, double narrow);

  /// Sooner for points in ascending order.
  EnclosedRgb at(double t);

 private:
  struct Place {
    double t;
    EnclosedRgb light;
  };

  EnclosedRgb next(const Place& from, double t) const;
  void add_growth(double t0, double t1, int divisions, EnclosedRgb& sum) const;

  const RayFog* m_fog = nullptr;
  double m_narrow = 0.0;
  std::vector<Place> m_places;  ///< ascending, the edges of the fog among them; none where it has closed form
};

}  // namespace pileus
