#include "lib/cloud/cloud_region.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "lib/core/error.h"

namespace pileus {

namespace {

/// Octaves that are summed before it is looked who needs the others.
constexpr size_t kFirstOctaves = 3, kNextOctaves = 2;

/// Rounding of products of factors in single precision, relative.
constexpr double kFactorError = 1e-6;

/// Of factors that are >= 0.
Interval product(const Interval& a, const Interval& b) {
  return {a.lo * b.lo, a.hi * b.hi};
}

/// The rows of a block, along z, that still need something: a part of the block that holds them all.
struct RowRange {
  int i0 = 0, i1 = 0, j0 = 0, j1 = 0;  ///< [i0, i1) x [j0, j1)

  bool is_empty() const { return i0 >= i1; }
  void include(int i, int j) {
    if (is_empty()) {
      *this = {i, i + 1, j, j + 1};
    } else {
      i0 = std::min(i0, i), i1 = std::max(i1, i + 1), j0 = std::min(j0, j), j1 = std::max(j1, j + 1);
    }
  }
};

/// Densities at the points of one block, step by step.
class BlockSampler {
 public:
  BlockSampler(const PointLattice& points, const CloudFormula& formula)
      : m_points(points), m_formula(formula), m_row(size_t(points.count.z)), m_size(points.size()) {
    PILEUS_CHECK(m_size <= CloudRegion::kMaxPoints);
    m_all.include(0, 0), m_all.include(points.count.x - 1, points.count.y - 1);
  }

  size_t size() const { return m_size; }
  float* coverage() { return m_coverage.data(); }
  float* frayed() { return m_values.data(); }
  const RowRange& all() const { return m_all; }
  int64_t computed() const { return m_computed; }

  Vec3d point(int i, int j, int k) const { return m_points.first + m_points.step * Vec3d(i, j, k); }

  /// body(i, j, number of the row's first point)
  template <class Body>
  void for_rows(const RowRange& range, const Body& body) const {
    for (int i = range.i0; i < range.i1; ++i) {
      for (int j = range.j0; j < range.j1; ++j)
        body(i, j, (size_t(i) * size_t(m_points.count.y) + size_t(j)) * m_row);
    }
  }

  /// Turns the coverage into what the noise leaves of it.
  void carve(const CloudNoise& noise, const Interval& undecided, double detail_erosion) {
    std::fill_n(m_sums.begin(), m_size, 0.0f);
    RowRange open = m_all;
    for (size_t first = 0;;) {
      open = open_rows(open, noise, noise.rest(first), undecided, detail_erosion);
      if (open.is_empty() || first == noise.octaves()) break;
      const size_t last = std::min(noise.octaves(), first + (first == 0 ? kFirstOctaves : kNextOctaves));
      add_octaves(noise, first, last, open);
      first = last;
    }
    for (size_t i = 0; i < m_size; ++i) m_values[i] = m_formula.carved(m_coverage[i], noise.level(m_sums[i]));
  }

  /// Turns what is carved into what the detail leaves of it.
  void fray(const CloudNoise& noise, const Interval& undecided) {
    RowRange open;
    for_rows(m_all, [&](int i, int j, size_t at) {
      int count = 0;
      for (size_t k = at; k < at + m_row; ++k) {
        const float lo = m_formula.frayed(m_values[k], 0.0f);
        count += (m_values[k] > float(undecided.lo)) & (lo <= float(undecided.hi));
      }
      if (count > 0) open.include(i, j);
    });
    if (open.is_empty()) return;
    std::fill_n(m_sums.begin(), m_size, 0.0f);
    add_octaves(noise, 0, noise.octaves(), open);
    for_rows(open, [&](int, int, size_t at) {
      for (size_t k = at; k < at + m_row; ++k)
        m_values[k] = m_formula.frayed(m_values[k], noise.level(m_sums[k]));
    });
  }

 private:
  /// The rows with points that more octaves may bring from one side of the undecided values to the other.
  RowRange open_rows(const RowRange& among, const CloudNoise& noise, const Interval& rest,
                     const Interval& undecided, double detail_erosion) const {
    RowRange open;
    const float rest_lo = float(rest.lo), rest_hi = float(rest.hi), fray = float(detail_erosion);
    for_rows(among, [&](int i, int j, size_t at) {
      int count = 0;
      for (size_t k = at; k < at + m_row; ++k) {
        const float hi = m_formula.carved(m_coverage[k], noise.level(m_sums[k] + rest_hi));
        const float carved = m_formula.carved(m_coverage[k], noise.level(m_sums[k] + rest_lo));
        const float lo = carved - fray * (1 - CloudFormula::clamped(carved));
        count += (hi > float(undecided.lo)) & (lo <= float(undecided.hi));
      }
      if (count > 0) open.include(i, j);
    });
    return open;
  }

  void add_octaves(const CloudNoise& noise, size_t first, size_t last, const RowRange& rows) {
    const PointLattice part{point(rows.i0, rows.j0, 0), m_points.step,
                            Vec3i(rows.i1 - rows.i0, rows.j1 - rows.j0, m_points.count.z)};
    const std::span<float> added(m_added.data(), part.size());
    noise.octave_sums(first, last, part, added);
    m_computed += int64_t(part.size());
    size_t from = 0;
    for_rows(rows, [&](int, int, size_t at) {
      for (size_t k = 0; k < m_row; ++k) m_sums[at + k] += added[from + k];
      from += m_row;
    });
  }

  const PointLattice& m_points;
  const CloudFormula& m_formula;
  const size_t m_row, m_size;
  RowRange m_all;
  int64_t m_computed = 0;
  std::array<float, CloudRegion::kMaxPoints> m_coverage, m_sums, m_added, m_values;
};

}  // namespace

CloudRegion::CloudRegion(const ProceduralCloud& cloud, CloudBody::Local form, const Box3d& box_world)
    : m_cloud(&cloud), m_form(std::move(form)) {
  const CloudFormula& formula = cloud.m_formula;
  const Interval f = m_form.range();
  if (!(f.hi > 0)) return;
  const Interval height = cloud.m_shape.relative_height(box_world);
  Interval coverage{formula.coverage(std::max(f.lo, 0.0)), formula.coverage(std::max(f.hi, 0.0))};
  coverage = product(coverage, cloud.m_height_profile.range(height));
  if (cloud.m_coverage_map) coverage = product(coverage, cloud.m_coverage_map->range(box_world));
  const Interval frayed = frayed_range(coverage, box_world);
  const Interval before{formula.density(frayed.lo), formula.density(frayed.hi)};
  Interval factor = cloud.m_density_profile.range(height);
  if (cloud.m_texture) factor = product(factor, cloud.m_texture->range(box_world));
  if (cloud.m_density_map) factor = product(factor, {0.0, 1.0});
  const bool is_plain = factor.lo == 1 && factor.hi == 1;
  if (!is_plain) factor = {factor.lo * (1 - kFactorError), factor.hi * (1 + kFactorError)};
  m_range = product(before, factor);
}

Interval CloudRegion::frayed_range(const Interval& coverage, const Box3d& box_world) const {
  const CloudFormula& formula = m_cloud->m_formula;
  const CloudNoise& noise = m_cloud->m_noise;
  const double margin = formula.margin(), empty = formula.threshold - margin,
               full = formula.saturation() + margin;
  if (coverage.hi <= empty) return {-1, coverage.hi};  // noise only takes away

  const Box3d pattern = noise.pattern_box(box_world);
  Interval frayed;
  Interval sum;  // of the octaves so far
  for (size_t i = 0;; ++i) {
    const Interval n = noise.level(sum + noise.rest(i));
    frayed = {formula.carved(coverage.lo, n.lo), formula.carved(coverage.hi, n.hi)};
    if (m_cloud->m_detail) frayed.lo = formula.frayed(frayed.lo, 0.0);
    const bool is_decided = frayed.hi <= empty || frayed.lo > full;
    if (is_decided || i == noise.octaves()) break;
    sum = sum + noise.octave_range(i, pattern);
  }
  return {frayed.lo - margin, frayed.hi + margin};
}

void CloudRegion::form_values(const PointLattice& points, std::span<float> f) const {
  const CloudShape& shape = m_cloud->m_shape;
  if (!shape.is_changed()) {
    m_form.values(points, f);
    return;
  }
  std::array<std::array<float, kMaxPoints>, 3> offsets;
  size_t at = 0;
  for (int i = 0; i < points.count.x; ++i) {
    for (int j = 0; j < points.count.y; ++j) {
      for (int k = 0; k < points.count.z; ++k, ++at) {
        const Vec3d p = points.first + points.step * Vec3d(i, j, k);
        const Vec3d offset = shape.form_point(p) - m_form.anchor();
        for (size_t axis = 0; axis < 3; ++axis) offsets[axis][at] = float(offset[int(axis)]);
      }
    }
  }
  const auto part = [at](const std::array<float, kMaxPoints>& all) { return std::span(all.data(), at); };
  m_form.values(part(offsets[0]), part(offsets[1]), part(offsets[2]), f);
}

int64_t CloudRegion::densities(const PointLattice& points, std::span<float> rho) const {
  const ProceduralCloud& cloud = *m_cloud;
  const CloudFormula& formula = cloud.m_formula;
  const auto height = [&](int j) {
    return cloud.m_shape.relative_height(points.first.y + points.step.y * double(j));
  };
  BlockSampler sampler(points, formula);

  form_values(points, rho);
  float* const coverage = sampler.coverage();
  float most = 0;
  sampler.for_rows(sampler.all(), [&](int i, int j, size_t at) {
    const float factor = float(cloud.m_height_profile.value(height(j)));
    for (size_t k = at; k < at + size_t(points.count.z); ++k) {
      coverage[k] = factor * formula.coverage(std::max(rho[k], 0.0f));
      if (cloud.m_coverage_map)
        coverage[k] *= float(cloud.m_coverage_map->value(sampler.point(i, j, int(k - at))));
      most = std::max(most, coverage[k]);
    }
  });
  if (!(most > float(formula.threshold))) {  // noise only takes away
    std::fill(rho.begin(), rho.end(), 0.0f);
    return 0;
  }

  const Interval undecided{formula.threshold - formula.margin(), formula.saturation() + formula.margin()};
  sampler.carve(cloud.m_noise, undecided, cloud.m_detail ? formula.detail_erosion : 0.0);
  if (cloud.m_detail) sampler.fray(*cloud.m_detail, undecided);
  const float* const frayed = sampler.frayed();
  for (size_t i = 0; i < sampler.size(); ++i) rho[i] = formula.density(frayed[i]);
  apply_factors(points, rho);
  return sampler.computed();
}

void CloudRegion::apply_factors(const PointLattice& points, std::span<float> rho) const {
  const ProceduralCloud& cloud = *m_cloud;
  size_t at = 0;
  for (int i = 0; i < points.count.x; ++i) {
    for (int j = 0; j < points.count.y; ++j) {
      const Vec3d first = points.first + points.step * Vec3d(i, j, 0);
      const float factor = float(cloud.m_density_profile.value(cloud.m_shape.relative_height(first.y)));
      for (int k = 0; k < points.count.z; ++k, ++at) {
        rho[at] *= factor;
        if (cloud.m_texture && rho[at] > 0) {
          rho[at] *= float(cloud.m_texture->value(first + Vec3d(0, 0, points.step.z * k)));
        }
        if (cloud.m_density_map && rho[at] > 0) {
          rho[at] *= float(cloud.m_density_map(first + Vec3d(0, 0, points.step.z * k), points.step.z));
        }
      }
    }
  }
}

}  // namespace pileus
