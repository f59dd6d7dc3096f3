#pragma once

#include <vector>

#include "lib/math/vec.h"

namespace pileus {

/// Fog that depends on distance alone and has one colour: what shows at a distance, per point or from a
/// table.
class Fading {
 public:
  enum class Law { linear, exponential, exponential_squared };
  enum class Per {
    pixel,   ///< the law itself, at every point
    table,   ///< linear between kEntries equal steps of distance
    vertex,  ///< the law at the corners of square tiles of the picture, bilinear between them
  };

  static constexpr int kEntries = 256;  ///< of a table, after the first
  static constexpr int kTile = 16;      ///< edge of a tile [pixels]

  Law law = Law::exponential;
  Per per = Per::pixel;
  bool is_planar = false;            ///< distances are those along the view axis
  double start = 0.0, end = 1000.0;  ///< [m]; end: of the linear law
  double density = 0.001;            ///< of the others [1/m]
  Rgb colour{0.0};

  /// Makes the table where one is read. To be called once all of the above is set.
  void prepare();

  /// What counts as the distance of t on a ray.
  double distance(double t, const Vec3d& direction, const Vec3d& axis) const;

  /// Share of what lies at a distance >= 0 [m] that shows, by the law.
  double fade(double distance) const;

  /// The same as `per` says: from the table where there is one. `vertex` is for whoever knows the picture.
  double shown(double distance) const;

 private:
  double reach() const;

  std::vector<float> m_table;  ///< [kEntries + 1], from `start` on; empty: none
  double m_entries_per_metre = 0.0;
};

}  // namespace pileus
