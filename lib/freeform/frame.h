#pragma once

#include <array>

#include "lib/math/affine.h"
#include "lib/math/vec.h"

namespace pileus {

/// Local coordinates of a solid, centre 0 and size about 1, so that one far from the origin loses no digits
/// (METHODS 4.1): p = center + sum axes[k] local[k]. The axes are linearly independent, of any length and
/// angle.
class Frame {
 public:
  Frame() = default;  ///< local coordinates are those of the space around [m]

  /// Axes along those of space, of lengths `size` [m].
  explicit Frame(const Vec3d& center, const Vec3d& size = Vec3d(1.0))
      : m_center(center),
        m_axes{Vec3d(size.x, 0, 0), Vec3d(0, size.y, 0), Vec3d(0, 0, size.z)},
        m_rows{Vec3d(1 / size.x, 0, 0), Vec3d(0, 1 / size.y, 0), Vec3d(0, 0, 1 / size.z)} {}

  Frame(const Vec3d& center, const std::array<Vec3d, 3>& axes) : m_center(center), m_axes(axes) {
    // With unit vectors neither small nor large axes leave the range of numbers.
    const std::array<Vec3d, 3> unit{normalize(axes[0]), normalize(axes[1]), normalize(axes[2])};
    const double volume = dot(unit[0], cross(unit[1], unit[2]));
    for (size_t k = 0; k < 3; ++k) {
      m_rows[k] = cross(unit[(k + 1) % 3], unit[(k + 2) % 3]) / volume / length(axes[k]);
    }
  }

  const Vec3d& center() const { return m_center; }
  const Vec3d& axis(int k) const { return m_axes[size_t(k)]; }

  /// local[k] = dot(row(k), p - center)
  const Vec3d& row(int k) const { return m_rows[size_t(k)]; }

  Vec3d local_from_offset(const Vec3d& offset) const {
    return {dot(m_rows[0], offset), dot(m_rows[1], offset), dot(m_rows[2], offset)};
  }
  Vec3d local_point(const Vec3d& p) const { return local_from_offset(p - m_center); }
  Vec3d point(const Vec3d& local) const {
    return m_center + m_axes[0] * local.x + m_axes[1] * local.y + m_axes[2] * local.z;
  }

  /// Gradient with respect to p of a function whose gradient with respect to local coordinates is given.
  Vec3d gradient(const Vec3d& local) const {
    return m_rows[0] * local.x + m_rows[1] * local.y + m_rows[2] * local.z;
  }

  /// The frame after space has been moved by a map.
  Frame moved(const Affine& map) const {
    return Frame(map.point(m_center),
                 {map.direction(m_axes[0]), map.direction(m_axes[1]), map.direction(m_axes[2])});
  }

  /// The frame for those who see space in local coordinates of another.
  Frame relative_to(const Frame& other) const {
    return Frame(other.local_point(m_center),
                 {other.local_from_offset(m_axes[0]), other.local_from_offset(m_axes[1]),
                  other.local_from_offset(m_axes[2])});
  }

 private:
  Vec3d m_center{0.0, 0.0, 0.0};
  std::array<Vec3d, 3> m_axes{Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1)};
  std::array<Vec3d, 3> m_rows{Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1)};
};

}  // namespace pileus
