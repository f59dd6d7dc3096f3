#pragma once

#include "lib/math/vec.h"

namespace pileus {

/// An affine map of space, named result-from-source (`world_from_index`): p' = A p + b in column notation.
/// Imath multiplies row vectors from the left; this type keeps that convention out of the rest of the code.
class Affine {
 public:
  Affine() = default;  ///< the identity
  explicit Affine(const Imath::M44d& row_vector_matrix) : m_matrix(row_vector_matrix) {}

  static Affine translation(const Vec3d& offset) { return Affine(Imath::M44d().setTranslation(offset)); }
  static Affine scaling(const Vec3d& factors) { return Affine(Imath::M44d().setScale(factors)); }

  Vec3d point(const Vec3d& p) const {
    Vec3d result;
    m_matrix.multVecMatrix(p, result);
    return result;
  }
  Vec3d direction(const Vec3d& v) const {
    Vec3d result;
    m_matrix.multDirMatrix(v, result);
    return result;
  }

  /// Volume scale of the map; 0 where it is singular.
  double determinant() const { return m_matrix.determinant(); }

  /// The inverse map. Undefined for a singular map: check determinant() where the map comes from input.
  Affine inverse() const { return Affine(m_matrix.inverse()); }

  /// (a * b) applies b first.
  friend Affine operator*(const Affine& a, const Affine& b) { return Affine(b.m_matrix * a.m_matrix); }

  /// Row-vector matrix as Imath, OpenVDB and OpenEXR store it.
  const Imath::M44d& matrix() const { return m_matrix; }

 private:
  Imath::M44d m_matrix;
};

}  // namespace pileus
