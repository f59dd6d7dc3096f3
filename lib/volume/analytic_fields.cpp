#include "lib/volume/analytic_fields.h"

#include <algorithm>
#include <cmath>

#include "lib/math/box.h"
#include "lib/math/roots.h"

namespace pileus {
namespace {

/// A field that is one piece along every ray: Derived gives the piece and the density at a point.
template <class Derived>
class OnePieceField : public DensityField {
 public:
  double max_density() const final { return 1.0; }

  void append_pieces(const Ray& ray, Segment segment, std::vector<DensityPiece>& pieces,
                     FieldCounters& counters) const final {
    const DensityPiece piece = derived().piece(ray, segment);
    if (!(piece.t0 < piece.t1)) return;
    ++counters.density_samples;
    pieces.push_back(piece);
  }

  double column(const Ray& ray, Segment segment, double, FieldCounters& counters) const final {
    const DensityPiece piece = derived().piece(ray, segment);
    if (!(piece.t0 < piece.t1)) return 0.0;
    ++counters.density_samples;
    return column_to(piece, piece.t1);
  }

  void sample(const Ray& ray, double t0, double dt, std::span<double> rho,
              FieldCounters& counters) const final {
    counters.density_samples += rho.size();
    for (size_t i = 0; i < rho.size(); ++i) rho[i] = derived().density(ray.at(t0 + double(i) * dt));
  }

 private:
  const Derived& derived() const { return static_cast<const Derived&>(*this); }
};

constexpr std::array<double, 4> kOne{1.0, 1.0, 1.0, 1.0};

class BoxField final : public OnePieceField<BoxField> {
 public:
  explicit BoxField(const Box3d& box) : m_box(box) {}

  Box3d bounds() const override { return m_box; }
  double feature_size() const override { return std::numeric_limits<double>::infinity(); }
  double density(const Vec3d& p) const { return m_box.intersects(p) ? 1.0 : 0.0; }
  DensityPiece piece(const Ray& ray, Segment segment) const {
    segment = clip_to_box(ray, segment, m_box);
    return {segment.t0, segment.t1, kOne};
  }

 private:
  Box3d m_box;
};

class EllipsoidField final : public OnePieceField<EllipsoidField> {
 public:
  EllipsoidField(const Vec3d& center, const Vec3d& radii) : m_center(center), m_radii(radii) {}

  Box3d bounds() const override { return {m_center - m_radii, m_center + m_radii}; }
  double feature_size() const override { return std::numeric_limits<double>::infinity(); }
  double density(const Vec3d& p) const { return ((p - m_center) / m_radii).length2() <= 1.0 ? 1.0 : 0.0; }

  /// The ellipsoid becomes the unit sphere by a scaling that keeps t up to the factor |d / radii|.
  DensityPiece piece(const Ray& ray, Segment segment) const {
    const Vec3d o = (ray.o - m_center) / m_radii, d = ray.d / m_radii;
    const double scale = length(d);
    const Roots<double> hits = sphere_hits(o, d / scale, 1.0);
    if (hits.count < 2) return {};
    return {std::max(segment.t0, hits.t[0] / scale), std::min(segment.t1, hits.t[1] / scale), kOne};
  }

 private:
  Vec3d m_center, m_radii;
};

class HeightFogField final : public OnePieceField<HeightFogField> {
 public:
  HeightFogField(const Box3d& box, double scale_height) : m_box(box), m_scale_height(scale_height) {}

  Box3d bounds() const override { return m_box; }
  double feature_size() const override { return m_scale_height; }
  double density(const Vec3d& p) const { return m_box.intersects(p) ? density_at_height(p.y) : 0.0; }
  DensityPiece piece(const Ray& ray, Segment segment) const {
    segment = clip_to_box(ray, segment, m_box);
    const double rho = density_at_height(ray.o.y + segment.t0 * ray.d.y);
    return {segment.t0, segment.t1, {rho, rho, rho, rho}, -ray.d.y / m_scale_height};
  }

 private:
  double density_at_height(double y) const { return std::exp(-(y - m_box.min.y) / m_scale_height); }

  Box3d m_box;
  double m_scale_height;
};

}  // namespace

std::shared_ptr<const DensityField> make_box_field(const Box3d& box) {
  return std::make_shared<BoxField>(box);
}

std::shared_ptr<const DensityField> make_ellipsoid_field(const Vec3d& center, const Vec3d& radii) {
  return std::make_shared<EllipsoidField>(center, radii);
}

std::shared_ptr<const DensityField> make_height_fog_field(const Box3d& box, double scale_height) {
  return std::make_shared<HeightFogField>(box, scale_height);
}

}  // namespace pileus
