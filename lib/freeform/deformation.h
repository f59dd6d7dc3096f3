#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lib/freeform/frame.h"
#include "lib/math/vec.h"

namespace pileus {

class FreeForm;

/// A bending of space that carries a form along: f(p) becomes f(origin(p)), where origin(p) is the point that
/// the deformation brought to p. Along the axis z of its frame, from z = `from` to z = `to`, with
/// t = clamp((z - from) / (to - from), 0, 1), and whole beyond:
///   twist  turns the cross-section by angle * t about the axis
///   taper  scales it by 1 + (factor - 1) t
///   bend   bends the axis to an arc of that angle towards x. Space is cut open behind the arc's centre, on
///          the half plane opposite to the arc's middle: solids must stay on this side of the centre.
/// ref:     Barr 1984, Global and local deformations of solid primitives
/// threads: const calls are safe from many threads
class Deformation {
 public:
  enum class Kind { twist, taper, bend };

  Deformation() = default;
  static Deformation twist(const Vec3d& center, const Vec3d& axis, double from, double to, double angle);
  static Deformation taper(const Vec3d& center, const Vec3d& axis, double from, double to, double factor);
  static Deformation bend(const Vec3d& center, const Vec3d& axis, const Vec3d& towards, double from,
                          double to, double angle);

  /// The point of the form's own space, in coordinates of the frame, that lies at p now.
  Vec3d origin(const Vec3d& p) const { return local_origin(m_frame.local_point(p)); }

  /// Gradient at p, given that at its origin.
  Vec3d gradient(const Vec3d& p, const Vec3d& at_origin) const;

  /// A box around the origins of all points of a box. `u`: unit roundoff of whoever computes them.
  Box3d origins(const Box3d& box, double u) const;

  /// A box, perhaps infinite, around what a box of the form's own space has become.
  Box3d image(const Box3d& origins) const;

  /// The same from coordinates of the frame, in either precision.
  template <class T>
  Imath::Vec3<T> local_origin(const Imath::Vec3<T>& local) const;

  const Frame& frame() const { return m_frame; }

  /// The deformation after space has been moved by a map.
  Deformation moved(const Affine& map) const;

  /// The deformation for those who see space in local coordinates of a frame.
  Deformation relative_to(const Frame& frame) const;

 private:
  Deformation(Kind kind, const Frame& frame, double from, double to, double amount)
      : m_kind(kind), m_frame(frame), m_from(from), m_to(to), m_amount(amount) {}

  Box3d local_origins(const Box3d& local) const;
  Box3d bent_origins(const Box3d& local) const;
  Box3d local_image(const Box3d& origins) const;
  double curvature() const { return m_amount / (m_to - m_from); }

  /// Angle of a direction, counted so that the cut opposite to the arc's middle separates its ends.
  template <class T>
  T arc_angle(T x, T z) const {
    const T angle = std::atan2(z, x), cut = T(m_amount / 2 - std::numbers::pi);
    return angle <= cut ? angle + T(2 * std::numbers::pi) : angle;
  }

  Kind m_kind = Kind::twist;
  Frame m_frame;
  double m_from = 0.0, m_to = 1.0;
  double m_amount = 0.0;  ///< an angle [rad] or a factor
};

template <class T>
Imath::Vec3<T> Deformation::local_origin(const Imath::Vec3<T>& local) const {
  const T from = T(m_from), to = T(m_to), amount = T(m_amount);
  const T share = std::clamp((local.z - from) / (to - from), T(0), T(1));
  switch (m_kind) {
    case Kind::twist: {
      const T c = std::cos(amount * share), s = std::sin(amount * share);
      return {c * local.x + s * local.y, c * local.y - s * local.x, local.z};
    }
    case Kind::taper: {
      const T scale = 1 + (amount - 1) * share;
      return {local.x / scale, local.y / scale, local.z};
    }
    case Kind::bend: {
      // Round the arc's centre, at a distance of 1 from the axis: (1 - k x, k z), angle 0 where the arc
      // starts.
      const T k = amount / (to - from), z = local.z - from;
      if (k == 0) return local;
      const T angle = arc_angle(1 - k * local.x, k * z);
      if (angle <= 0) return local;
      if (angle >= amount) {
        const T c = std::cos(amount), s = std::sin(amount), half = std::sin(amount / 2);
        return {local.x * c - z * s + 2 * half * half / k, local.y, to + local.x * s + z * c - s / k};
      }
      const T radius = std::hypot(1 - k * local.x, k * z);
      return {(2 * local.x - k * (local.x * local.x + z * z)) / (1 + radius), local.y, from + angle / k};
    }
  }
  return local;
}

/// The form after a deformation.
FreeForm deformed(const FreeForm& form, const Deformation& deformation);

}  // namespace pileus
