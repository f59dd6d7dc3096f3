#include "lib/volume/analytic_fields.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "lib/math/box.h"
#include "lib/math/roots.h"
#include "lib/volume/known_columns.h"

namespace pileus {
namespace {

/// How far a function is from the line between its ends at most, where its values there and in the middle are
/// these and it is concave: it lies above that line, and below those that lead from the ends through its
/// middle.
double bend_of_concave(double c0, double middle, double c1) {
  return 2.0 * std::abs(middle - 0.5 * (c0 + c1));
}

/// The same where its logarithm is concave: that is between its own line and `bend` above. The exponential of
/// the line is convex, and nowhere farther below the line between its ends than an eighth of its largest
/// second derivative.
double bend_of_log_concave(double c0, double middle, double c1) {
  const double growth = std::log(c1 / c0);
  const double bend = 2.0 * std::abs(std::log(middle / c0) - 0.5 * growth);
  return std::max(c0, c1) * std::max(0.125 * growth * growth, std::expm1(bend));
}

/// A field that is one piece along every ray: Derived gives the piece, the density at a point, and bounds of
/// columns between the points of a part of a ray and a sun. Densities are concave where they are not 0, or
/// their logarithms are; then so are columns (Prekopa).
template <class Derived>
class OnePieceField : public DensityField, public KnownColumns {
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

  double column_bend(const Ray& ray, Segment part, const Vec3d& towards) const final {
    const double most = derived().most_column(ray, part, towards);
    if (!(most > 0.0)) return 0.0;
    const auto at = [&](double t) {
      const DensityPiece piece =
          derived().piece({ray.at(t), towards}, {0.0, std::numeric_limits<double>::infinity()});
      return piece.t0 < piece.t1 ? column_to(piece, piece.t1) : 0.0;
    };
    const double c0 = at(part.t0), c1 = at(part.t1);
    // Columns that are not 0 at both ends are so nowhere between: no edge is there.
    if (!(c0 > 0.0 && c1 > 0.0)) return most;
    const double middle = at(0.5 * (part.t0 + part.t1));
    return std::min(
        most, Derived::kIsConstant ? bend_of_concave(c0, middle, c1) : bend_of_log_concave(c0, middle, c1));
  }

 private:
  const Derived& derived() const { return static_cast<const Derived&>(*this); }
};

constexpr std::array<double, 4> kOne{1.0, 1.0, 1.0, 1.0};

/// Upper bound of what half lines from the points of a part of a ray have inside a box; 0 where none meets
/// it. On each of them lies what is inside behind three planes and its start, and in front of three planes:
/// each distance is linear along the ray.
double most_inside(const Box3d& box, const Ray& ray, Segment part, const Vec3d& towards) {
  constexpr double kRounding = 1e-12;
  const Vec3d p0 = ray.at(part.t0), p1 = ray.at(part.t1);
  std::array<std::pair<double, double>, 4> entries{};
  std::array<std::pair<double, double>, 3> exits;
  size_t planes = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double rate = towards[axis];
    double near = box.min[axis], far = box.max[axis];
    if (rate == 0.0) {
      const double margin = kRounding * (length(p0) + length(p1) + std::abs(near) + std::abs(far));
      if (std::max(p0[axis], p1[axis]) < near - margin || std::min(p0[axis], p1[axis]) > far + margin)
        return 0.0;
      continue;
    }
    if (rate < 0.0) std::swap(near, far);
    exits[planes] = {(far - p0[axis]) / rate, (far - p1[axis]) / rate};
    entries[++planes] = {(near - p0[axis]) / rate, (near - p1[axis]) / rate};
  }
  double most = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < planes; ++i) {
    for (size_t j = 0; j <= planes; ++j)
      most = std::min(most, std::max(exits[i].first - entries[j].first, exits[i].second - entries[j].second));
  }
  return std::max(0.0, most);
}

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
  static constexpr bool kIsConstant = true;
  double most_column(const Ray& ray, Segment part, const Vec3d& towards) const {
    return most_inside(m_box, ray, part, towards);
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
  static constexpr bool kIsConstant = true;

  /// In the space of the unit sphere, from point f along w, it ends at (-w.f + root) / w.w and is no longer
  /// than twice the root of (w.f)^2 - w.w (f.f - 1). Along the ray w.f is linear, and what is under the root
  /// concave.
  double most_column(const Ray& ray, Segment part, const Vec3d& towards) const {
    const Vec3d w = towards / m_radii, step = (part.t1 - part.t0) * ray.d / m_radii;
    const Vec3d f0 = (ray.at(part.t0) - m_center) / m_radii, f1 = f0 + step;
    const auto under_root = [&](const Vec3d& f) {
      const double along = dot(w, f);
      return along * along - dot(w, w) * (dot(f, f) - 1.0);
    };
    const double ahead = dot(w, step), bend = dot(w, w) * dot(step, step) - ahead * ahead;
    const double most = std::max(under_root(f0), under_root(f1)) + 0.25 * std::max(0.0, bend);
    if (!(most > 0.0)) return 0.0;
    const double root = std::sqrt(most), behind = std::min(dot(w, f0), dot(w, f1));
    return std::max(0.0, std::min(2.0 * root, root - behind)) / dot(w, w);
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
  static constexpr bool kIsConstant = false;
  double most_column(const Ray& ray, Segment part, const Vec3d& towards) const {
    const double lowest = std::min(ray.at(part.t0).y, ray.at(part.t1).y);
    const double densest = towards.y < 0.0 ? 1.0 : density_at_height(std::max(lowest, m_box.min.y));
    return densest * most_inside(m_box, ray, part, towards);
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
