#include "integrators/shadow_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/math/box.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What a piece of a ray passes through.
struct Matter {
  double voxel = kInfinity;  ///< the smallest; infinite where there is haze alone [m]
  double sigma = 0.0;        ///< extinction, at most [1/m]

  bool is_haze() const { return std::isinf(voxel); }
};

/// Upper bound of the density on a piece of a ray through a medium without voxels.
double densest_on(const DensityField& density, const Ray& ray, const Segment& piece) {
  thread_local std::vector<DensityPiece> parts;
  FieldCounters counters;
  parts.clear();
  density.append_pieces(ray, piece, parts, counters);
  double densest = 0.0;
  for (const DensityPiece& part : parts) {
    densest = part.rate == 0.0 ? std::max(densest, *std::max_element(part.rho.begin(), part.rho.end()))
                               : std::max({densest, density_at(part, part.t0), density_at(part, part.t1)});
  }
  return densest;
}

Matter matter_on(const World& world, const Ray& ray, const Segment& piece) {
  Matter matter;
  for (const WorldMedium& medium : world.media) {
    const DensityField& density = *medium.density;
    if (clip_to_box(ray, piece, density.bounds()).empty()) continue;
    if (density.has_bricks()) matter.voxel = std::min(matter.voxel, density.feature_size());
    matter.sigma +=
        medium.extinction * (density.has_bricks() ? density.max_density() : densest_on(density, ray, piece));
  }
  return matter;
}

/// The search of one packet for the shadows of one solid.
class Search {
 public:
  Search(const World& world, const SearchDetail& detail, const Shape& solid, const Vec3d& towards_sun,
         std::span<const SearchedRay> rays)
      : m_world(world), m_detail(detail), m_solid(solid), m_towards_sun(towards_sun), m_rays(rays) {}

  uint64_t run(std::span<Segments> shadows) {
    for (size_t i = 0; i < m_rays.size(); ++i) {
      for (const Segment& stretch : m_rays[i].may_be_shaded) add_run(i, stretch);
    }
    if (m_runs.empty()) return 0;
    look();
    find_edges();
    while (halve_edges()) {
    }
    for (const Run& run : m_runs) append_shadows(run, shadows[run.ray]);
    return m_asked;
  }

 private:
  /// A point of a ray from which the sun is looked for.
  struct Look {
    double t;
    double edge_error;      ///< that is allowed beside it [m]
    bool is_known = false;  ///< to be lit, without looking
    char is_shaded = 0;
  };

  /// Where an answer changes.
  struct Edge {
    size_t ray;
    double before, after, error;
    char is_shaded_before;
    int halvings = 0;

    double middle() const { return 0.5 * (before + after); }
    bool is_open() const {
      constexpr int kMostHalvings = 24;
      return after - before > error && halvings < kMostHalvings;
    }
  };

  /// A stretch of a ray with its looks, and then its edges.
  struct Run {
    size_t ray;
    Segment stretch;
    size_t first, end;
    size_t first_edge = 0, end_edge = 0;
  };

  const Ray& ray(size_t i) const { return m_rays[i].ray; }

  /// Beyond the ends of a stretch it is light, unless the media end there.
  void add_run(size_t i, const Segment& stretch) {
    const SearchedRay& of = m_rays[i];
    const size_t first = m_looks.size();
    if (stretch.t0 > of.media.t0) m_looks.push_back({stretch.t0, kInfinity, true});
    const size_t first_unknown = m_looks.size();
    double depth = 0.0;
    double t0 = stretch.t0;
    for (const double t1 : cuts_at_media(of.ray, stretch)) {
      if (t1 > t0) depth += add_looks(of, {t0, t1});
      t0 = std::max(t0, t1);
    }
    const bool is_negligible = *of.left_out + depth <= m_detail.negligible_depth;
    if (is_negligible || m_looks.size() == first_unknown) {
      *of.left_out += is_negligible ? depth : 0.0;
      m_looks.resize(first);
      return;
    }
    if (stretch.t1 < of.media.t1) m_looks.push_back({stretch.t1, kInfinity, true});
    m_runs.push_back({i, stretch, first, m_looks.size()});
  }

  /// Where media begin or end, and where the stretch does.
  std::vector<double> cuts_at_media(const Ray& of, const Segment& stretch) const {
    std::vector<double> cuts{stretch.t1};
    for (const WorldMedium& medium : m_world.media) {
      const Segment inside = clip_to_box(of, stretch, medium.density->bounds());
      if (!inside.empty()) cuts.insert(cuts.end(), {inside.t0, inside.t1});
    }
    std::sort(cuts.begin(), cuts.end());
    return cuts;
  }

  /// Returns the optical depth of the piece, at most.
  double add_looks(const SearchedRay& of, const Segment& piece) {
    constexpr double kFewest = 1.0, kMost = 512.0, kStepsOfError = 4096.0, kPartsOfNegligible = 16.0;
    const Matter matter = matter_on(m_world, of.ray, piece);
    const double depth = matter.sigma * piece.length();
    if (!(matter.sigma > 0.0)) return 0.0;
    const double longest = matter.is_haze() ? m_detail.least_depth / matter.sigma : matter.voxel;
    double wanted = std::clamp(piece.length() / std::min(longest, of.longest_step), kFewest, kMost);
    double error = 0.0;
    if (matter.is_haze()) {
      wanted = std::min(wanted, depth / m_detail.negligible_depth);
      error = m_detail.negligible_depth / kPartsOfNegligible / matter.sigma;
    }
    constexpr double kRounding = 1e-6;  // a piece that is one step need not be two
    const int steps = std::max(1, int(std::ceil(wanted - kRounding)));
    const double step = piece.length() / steps;
    for (int k = 0; k < steps; ++k)
      m_looks.push_back({piece.t0 + (k + 0.5) * step, std::max(error, step / kStepsOfError)});
    return depth;
  }

  std::vector<char> ask() {
    m_asked += m_points.size();
    return are_shaded(m_solid, m_towards_sun, m_points);
  }

  void look() {
    std::vector<Look*> asked;
    for (const Run& run : m_runs) {
      for (size_t n = run.first; n < run.end; ++n) {
        if (m_looks[n].is_known) continue;
        asked.push_back(&m_looks[n]);
        m_points.push_back(ray(run.ray).at(m_looks[n].t));
      }
    }
    const std::vector<char> answers = ask();
    for (size_t n = 0; n < asked.size(); ++n) asked[n]->is_shaded = answers[n];
  }

  void find_edges() {
    for (Run& run : m_runs) {
      run.first_edge = m_edges.size();
      for (size_t n = run.first + 1; n < run.end; ++n) {
        const Look &before = m_looks[n - 1], &after = m_looks[n];
        if (before.is_shaded == after.is_shaded) continue;
        m_edges.push_back(
            {run.ray, before.t, after.t, std::min(before.edge_error, after.edge_error), before.is_shaded});
      }
      run.end_edge = m_edges.size();
    }
  }

  /// Returns false where all are known well enough.
  bool halve_edges() {
    std::vector<Edge*> asked;
    m_points.clear();
    for (Edge& edge : m_edges) {
      if (!edge.is_open()) continue;
      asked.push_back(&edge);
      m_points.push_back(ray(edge.ray).at(edge.middle()));
    }
    if (asked.empty()) return false;
    const std::vector<char> is_shaded = ask();
    for (size_t n = 0; n < asked.size(); ++n) {
      Edge& edge = *asked[n];
      (is_shaded[n] == edge.is_shaded_before ? edge.before : edge.after) = edge.middle();
      ++edge.halvings;
    }
    return true;
  }

  void append_shadows(const Run& run, Segments& shadows) const {
    bool is_shaded = m_looks[run.first].is_shaded != 0;
    double begin = run.stretch.t0;
    for (size_t n = run.first_edge; n < run.end_edge; ++n) {
      const double edge = m_edges[n].middle();
      if (is_shaded) append(shadows, {begin, edge});
      begin = edge;
      is_shaded = !is_shaded;
    }
    if (is_shaded) append(shadows, {begin, run.stretch.t1});
  }

  const World& m_world;
  const SearchDetail& m_detail;
  const Shape& m_solid;
  const Vec3d m_towards_sun;
  std::span<const SearchedRay> m_rays;
  std::vector<Look> m_looks;
  std::vector<Run> m_runs;
  std::vector<Edge> m_edges;
  std::vector<Vec3d> m_points;
  uint64_t m_asked = 0;
};

/// The way from a point to a light.
struct LightLine {
  Vec3d wi;
  double distance;
};

template <class ToLight>
std::vector<char> are_shaded(const Shape& solid, std::span<const Vec3d> points, ToLight&& to_light) {
  thread_local std::vector<Ray> rays;
  thread_local std::vector<Segment> segments;
  thread_local std::vector<RaySight> seen;
  rays.clear();
  segments.clear();
  for (const Vec3d& p : points) {
    const LightLine line = to_light(p);
    rays.push_back({p, line.wi});
    segments.push_back({0.0, line.distance});
  }
  seen.resize(points.size());
  std::vector<char> met(points.size(), 0);
  solid.find_met(rays, segments, seen, met);
  return met;
}

}  // namespace

std::vector<char> are_shaded(const Shape& solid, const Vec3d& towards_sun, std::span<const Vec3d> points) {
  return are_shaded(solid, points, [&](const Vec3d&) { return LightLine{towards_sun, kInfinity}; });
}

std::vector<char> are_shaded(const Shape& solid, const Light& light, std::span<const Vec3d> points) {
  return are_shaded(solid, points, [&](const Vec3d& p) {
    const Illumination at = light.at(p);
    return LightLine{at.wi, at.distance};
  });
}

uint64_t search_shadows(const World& world, const SearchDetail& detail, const Shape& solid,
                        const Vec3d& towards_sun, std::span<const SearchedRay> rays,
                        std::span<Segments> shadows) {
  return Search(world, detail, solid, towards_sun, rays).run(shadows);
}

}  // namespace pileus
