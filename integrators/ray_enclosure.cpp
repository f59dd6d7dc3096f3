#include "integrators/ray_enclosure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/math/absolute.h"
#include "lib/math/transmittance.h"

namespace pileus {
namespace {

double largest(const Rgb& rgb) {
  return std::max({std::abs(rgb.x), std::abs(rgb.y), std::abs(rgb.z)});
}

Rgb larger(const Rgb& a, const Rgb& b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

}  // namespace

double error_bound(const EnclosedRgb& exact, const Rgb& estimate) {
  const Rgb error = absolute(estimate - exact.mid) + exact.half;
  const bool is_known = std::isfinite(error.x) && std::isfinite(error.y) && std::isfinite(error.z);
  return is_known ? largest(error) : std::numeric_limits<double>::infinity();
}

RayEnclosure::RayEnclosure(const EnclosedWorld& enclosed)
    : m_enclosed(enclosed), m_world(enclosed.world()), m_lights(enclosed.march().suns().size()) {
  for (const WorldMedium& medium : m_world.media) {
    m_extinction.push_back(medium.extinction);
    m_terms = std::max(m_terms, medium.scattering.size());
  }
  m_pieces.resize(m_world.media.size());
}

EnclosedRgb RayEnclosure::enclose(const Ray& ray, Segment segment, const EnclosedRgb& behind,
                                  const Rgb& estimate, const Goal& goal, const RayFog* fog) {
  constexpr double kNarrowLight = 1e-3;
  m_ray = ray;
  m_fog = fog;
  m_fog_light.build(fog, kNarrowLight * goal.half_width);
  m_zones.clear();
  m_enclosed.append_zones(ray, segment, m_zones);
  m_profile.build(m_world, ray, segment, cuts(segment), counters);
  set_weights(-ray.d);
  cut_stretches();
  EnclosedRgb end = behind;
  if (fog && !fog->has_closed_form()) {
    end += m_fog_light.at(segment.t1);
    end.mid -= fog->end().light;
  }
  if (m_stretches.empty()) return end;

  const double passed = transmittance(m_profile.tau());
  narrow(estimate - passed * end.mid, goal_on_ray(goal));
  EnclosedRgb total{passed * end.mid,
                    passed * end.half + Rgb(rounding(end.mid + end.half, m_stretches.back().t1))};
  for (const Stretch& stretch : m_stretches) total += stretch.radiance;
  return total;
}

/// Where no grid is in the way, depths are closed forms: intervals that are much narrower take little longer.
RayEnclosure::Goal RayEnclosure::goal_on_ray(Goal goal) const {
  constexpr double kNarrower = 0.1;
  if (m_zones.empty()) goal.half_width *= kNarrower;
  return goal;
}

/// Where fog has edges, and where stretches of hazes have to be short.
std::vector<double> RayEnclosure::cuts(Segment segment) const {
  std::vector<double> cuts = m_fog ? m_fog->edges() : std::vector<double>{};
  if (m_enclosed.has_hazes()) {
    for (const EnclosedWorld::Zone& zone : m_zones) cuts.insert(cuts.end(), {zone.along.t0, zone.along.t1});
  }
  std::erase_if(cuts, [&](double t) { return !(t > segment.t0 && t < segment.t1); });
  return cuts;
}

/// Refines the stretches, those first where it pays most, until their sum is narrow enough.
void RayEnclosure::narrow(const Rgb& estimate, const Goal& goal) {
  constexpr double kOfSettled = 0.1;
  EnclosedRgb total;
  Rgb settled(0.0);
  std::vector<std::pair<double, size_t>> queue;  // what dividing a stretch once more is worth
  const auto enqueue = [&](size_t i) {
    const Stretch& stretch = m_stretches[i];
    const double width = largest(stretch.radiance.half - stretch.settled);
    queue.emplace_back(width / double(std::max<size_t>(1, stretch.parts.size())), i);
    std::push_heap(queue.begin(), queue.end());
  };
  for (size_t i = 0; i < m_stretches.size(); ++i) {
    total += m_stretches[i].radiance;
    enqueue(i);
  }
  const uint64_t last_lookup = depth_lookups + goal.most_lookups;
  for (size_t round = 0; round < goal.most_lookups && depth_lookups < last_lookup; ++round) {
    const double width = largest(total.half), distance = largest(estimate - total.mid);
    const double enough = std::max(goal.half_width, goal.share * distance);
    const bool is_narrow = width <= enough || largest(total.half - settled) <= kOfSettled * largest(settled);
    if (is_narrow || !(queue.front().first > 0.0)) break;
    std::pop_heap(queue.begin(), queue.end());
    const size_t i = queue.back().second;
    queue.pop_back();
    Stretch& stretch = m_stretches[i];
    total.mid -= stretch.radiance.mid;
    total.half -= stretch.radiance.half;
    settled -= stretch.settled;
    refine(stretch, i);
    total += stretch.radiance;
    settled += stretch.settled;
    enqueue(i);
  }
}

void RayEnclosure::set_weights(const Vec3d& wo) {
  const size_t media = m_world.media.size();
  m_weights.assign(media * m_lights * m_terms, Rgb(0.0));
  m_darkest.assign(media * m_lights, Rgb(0.0));
  m_brightest.assign(media * m_lights, Rgb(0.0));
  m_steepest = 0.0;
  for (size_t m = 0; m < media; ++m) {
    const WorldMedium& medium = m_world.media[m];
    double steepness = 0.0;
    for (size_t l = 0; l < m_lights; ++l) {
      const Illumination& sun = m_enclosed.march().suns()[l];
      const double p = medium.phase->p(wo, sun.wi);
      for (size_t k = 0; k < medium.scattering.size(); ++k) {
        const ScatterTerm& term = medium.scattering[k];
        const Rgb weight = medium.albedo * sun.irradiance * phase_weight(term, p);
        m_weights[(m * m_lights + l) * m_terms + k] = weight;
        m_brightest[m * m_lights + l] += larger(weight, Rgb(0.0));
        m_darkest[m * m_lights + l] -= larger(-weight, Rgb(0.0));
        steepness += largest(weight) * term.extinction;
      }
    }
    m_steepest = std::max(m_steepest, steepness);
  }
}

void RayEnclosure::cut_stretches() {
  m_stretches.clear();
  m_depths.clear();
  m_slopes.clear();
  m_brightest_fog = Rgb(0.0);
  const auto& spans = m_profile.spans();
  for (size_t i = 0; i < spans.size(); ++i) {
    add_stretches(i, i > 0 && spans[i - 1].t1 == spans[i].t0);
  }
}

void RayEnclosure::add_stretches(size_t span, bool is_joined) {
  const RayProfile::Span& whole = m_profile.spans()[span];
  double cells = 0.0;
  bool is_in_haze_alone = true;
  for (const EnclosedWorld::Zone& zone : m_zones) {
    if (!(zone.along.t0 < whole.t1 && zone.along.t1 > whole.t0)) continue;
    cells = std::max(cells, (whole.t1 - whole.t0) * zone.cells_per_metre);
    is_in_haze_alone = false;
  }
  const int count = std::max(1, int(std::ceil(cells * (1.0 - 1e-9))));
  for (int n = 0; n < count; ++n) {
    const auto at = [&](int k) {
      return k == count ? whole.t1 : whole.t0 + k * ((whole.t1 - whole.t0) / count);
    };
    Stretch stretch;
    stretch.span = span;
    stretch.t0 = at(n);
    stretch.t1 = at(n + 1);
    stretch.tau0 = whole.tau0 + m_profile.tau_to(span, stretch.t0);
    stretch.is_joined = n > 0 || is_joined;
    stretch.is_in_haze_alone = is_in_haze_alone;
    load_part(span, stretch.t0, stretch.t1, stretch.tau0);
    stretch.radiance = unlit(stretch.t0, stretch.t1);
    for (size_t l = 0; l < m_lights; ++l) stretch.shades.push_back(shade_between(l, stretch.t0, stretch.t1));
    stretch.radiance += any_light(stretch.shades);
    m_brightest_fog = larger(m_brightest_fog, m_part.fog_front());
    m_stretches.push_back(std::move(stretch));
  }
}

void RayEnclosure::load_part(size_t span, double t0, double t1, double tau0) {
  for (size_t m = 0; m < m_pieces.size(); ++m) {
    const DensityPiece* piece = m_profile.piece_of(span, m);
    m_pieces[m] = piece ? part_of(*piece, t0, t1) : DensityPiece{};
  }
  m_part.set(t0, t1, tau0, m_pieces, m_extinction, m_fog, m_fog_light.at(t0));
}

/// What needs no suns: the fog's light and the media's own, and that of the sky around, which is linear in
/// height.
EnclosedRgb RayEnclosure::unlit(double t0, double t1) const {
  EnclosedRgb sum = m_part.fog_light();
  for (size_t m = 0; m < m_world.media.size(); ++m) {
    const WorldMedium& medium = m_world.media[m];
    if (m_enclosed.plan().emission) sum += scaled(medium.emission, m_part.seen(m));
    const AmbientLight& sky = medium.ambient;
    if (!m_enclosed.plan().ambient || !sky.is_on()) continue;
    const Rgb scattered = medium.extinction * medium.albedo;
    const Rgb per_metre = (sky.top - sky.bottom) / (sky.y1 - sky.y0);
    const double middle = m_ray.o.y + 0.5 * (t0 + t1) * m_ray.d.y;
    sum += scaled(scattered * (sky.bottom + per_metre * (middle - sky.y0)), m_part.seen(m));
    if (sky.top == sky.bottom) continue;
    sum += scaled(scattered * per_metre * ((t1 - t0) * m_ray.d.y), m_part.seen_slope(m));
  }
  return sum;
}

/// Scattered light of suns of which no more is known than where solids keep them from.
EnclosedRgb RayEnclosure::any_light(const std::vector<Shade>& shades) const {
  EnclosedRgb sum;
  for (size_t m = 0; m < m_world.media.size(); ++m) {
    const Enclosed& seen = m_part.seen(m);
    for (size_t l = 0; l < m_lights; ++l) {
      if (shades[l] == Shade::all) continue;
      const Rgb &darkest = m_darkest[m * m_lights + l], &brightest = m_brightest[m * m_lights + l];
      sum += scaled(0.5 * m_extinction[m] * (brightest + darkest), seen);
      sum.half += 0.5 * m_extinction[m] * seen.most() * (brightest - darkest);
    }
  }
  return sum;
}

Shade RayEnclosure::shade_between(size_t light, double t0, double t1) const {
  return m_enclosed.shades().between(light, m_ray.at(t0), m_ray.at(t1), position_error(t1));
}

void RayEnclosure::refine(Stretch& stretch, size_t index) {
  if (stretch.parts.empty()) {
    look_at_light(stretch, index);
  } else {
    divide_parts(stretch);
  }
  sum_up(stretch);
}

void RayEnclosure::look_at_light(Stretch& stretch, size_t index) {
  if (stretch.end0 == kUnknown) {
    stretch.end0 = depths_at(stretch.t0);
    if (stretch.is_joined) m_stretches[index - 1].end1 = stretch.end0;
  }
  if (stretch.end1 == kUnknown) {
    stretch.end1 = depths_at(stretch.t1);
    const bool joins = index + 1 < m_stretches.size() && m_stretches[index + 1].is_joined;
    if (joins) m_stretches[index + 1].end0 = stretch.end1;
  }
  const Vec3d middle = m_ray.at(0.5 * (stretch.t0 + stretch.t1)), step = m_ray.d * (stretch.t1 - stretch.t0);
  for (size_t l = 0; l < m_lights; ++l) {
    stretch.variation.push_back(m_enclosed.depth_variation(l, middle, step));
  }
  depth_lookups += m_lights;
  stretch.parts.push_back(make_part(stretch, stretch.t0, stretch.t1, stretch.end0, stretch.end1));
}

/// Halves the parts that contribute more than half as much as the worst of those that may still get narrower.
void RayEnclosure::divide_parts(Stretch& stretch) {
  double worst = 0.0;
  for (const Part& part : stretch.parts) worst = std::max(worst, part.width);
  std::vector<Part> parts;
  for (const Part& part : stretch.parts) {
    const double t = 0.5 * (part.t0 + part.t1);
    if (!(part.width > 0.0) || part.width < 0.5 * worst || !(t > part.t0 && t < part.t1)) {
      parts.push_back(part);
      continue;
    }
    const int end = depths_at(t);
    parts.push_back(make_part(stretch, part.t0, t, part.end0, end));
    parts.push_back(make_part(stretch, t, part.t1, end, part.end1));
  }
  stretch.parts = std::move(parts);
}

RayEnclosure::Part RayEnclosure::make_part(const Stretch& stretch, double t0, double t1, int end0, int end1) {
  Part part;
  part.t0 = t0;
  part.t1 = t1;
  part.tau0 = m_profile.spans()[stretch.span].tau0 + m_profile.tau_to(stretch.span, t0);
  part.end0 = end0;
  part.end1 = end1;
  part.slopes = m_slopes.size();
  m_slopes.resize(m_slopes.size() + m_lights, Rgb(0.0));
  load_part(stretch.span, t0, t1, part.tau0);
  part.rough = part.fine = unlit(t0, t1);
  enclose_light(stretch, part);
  Rgb fine = part.fine.half;
  for (size_t l = 0; l < m_lights; ++l) fine += m_slopes[part.slopes + l] * stretch.variation[l];
  part.is_rough = largest(part.rough.half) <= largest(fine);
  part.width = largest((part.is_rough ? part.rough.half : fine) - part.settled);
  return part;
}

/// With V the variation of the derivative of the grids' depth over the part, h its share of the stretch: that
/// depth is within h V / 4 of linear anywhere, and within h V / 8 on average. What hazes add is within their
/// own bend of linear.
void RayEnclosure::enclose_light(const Stretch& stretch, Part& part) {
  const double share = (part.t1 - part.t0) / (stretch.t1 - stretch.t0);
  for (size_t l = 0; l < m_lights; ++l) {
    const Shade shade =
        stretch.shades[l] == Shade::unknown ? shade_between(l, part.t0, part.t1) : stretch.shades[l];
    if (shade == Shade::all) continue;
    const bool is_settled =
        shade == Shade::unknown && share <= m_enclosed.shades().finest(l, stretch.is_in_haze_alone);
    const double depth0 = m_depths[size_t(part.end0) * m_lights + l],
                 depth1 = m_depths[size_t(part.end1) * m_lights + l];
    const double haze_bend = m_enclosed.haze_bend(l, m_ray, {part.t0, part.t1});
    const double apart = 0.25 * share * stretch.variation[l] + haze_bend;
    const double least = std::max(0.0, std::min(depth0, depth1) - apart),
                 most = std::max(depth0, depth1) + apart;
    for (size_t m = 0; m < m_world.media.size(); ++m) {
      const Enclosed& seen = m_part.seen(m);
      if (!(seen.most() > 0.0)) continue;
      // Integral of T rho |difference from linear|, per variation.
      const double off_linear =
          share *
          std::min(0.125 * m_part.front() * m_part.max_density(m) * m_part.length(), 0.25 * seen.most());
      const auto& terms = m_world.media[m].scattering;
      for (size_t k = 0; k < terms.size(); ++k) {
        const double a = terms[k].extinction;
        const Rgb colour = m_extinction[m] * weight(m, l, k);
        const double bright = transmittance(a * least), dark = transmittance(a * most);
        if (shade == Shade::unknown) {  // any share of the light
          const EnclosedRgb any{0.5 * bright * seen.most() * colour,
                                0.5 * bright * seen.most() * absolute(colour)};
          part.fine += any;
          part.rough += any;
          if (is_settled) part.settled += any.half;
          continue;
        }
        part.fine += scaled(colour, m_part.seen_dimmed(m, a * depth0, a * depth1));
        part.fine.half += absolute(colour) * (a * bright * haze_bend * seen.most());
        m_slopes[part.slopes + l] += absolute(colour) * (a * bright * off_linear);
        part.rough += scaled(colour * (0.5 * (bright + dark)), seen);
        part.rough.half += absolute(colour) * (0.5 * (bright - dark) * seen.most());
      }
    }
  }
}

/// The variations of the parts add up to that of the stretch at most: all of it may lie where it does the
/// most harm, but only once.
void RayEnclosure::sum_up(Stretch& stretch) const {
  stretch.radiance = {};
  stretch.settled = Rgb(0.0);
  for (const Part& part : stretch.parts) {
    stretch.radiance += part.is_rough ? part.rough : part.fine;
    stretch.settled += part.settled;
  }
  for (size_t l = 0; l < m_lights; ++l) {
    Rgb worst(0.0);
    for (const Part& part : stretch.parts) {
      if (!part.is_rough) worst = larger(worst, m_slopes[part.slopes + l]);
    }
    stretch.radiance.half += worst * stretch.variation[l];
  }
}

/// Index of the exact depths towards all lights at t.
int RayEnclosure::depths_at(double t) {
  const Vec3d p = m_ray.at(t);
  for (size_t l = 0; l < m_lights; ++l) m_depths.push_back(m_enclosed.depth(l, p, counters));
  depth_lookups += m_lights;
  return int(m_depths.size() / std::max<size_t>(1, m_lights)) - 1;
}

/// How far a point of the ray may lie from where it should [m].
double RayEnclosure::position_error(double t) const {
  constexpr double kUlps = 32.0;
  return kUlps * std::numeric_limits<double>::epsilon() * (length(m_ray.o) + t);
}

/// What rounding can do: sums and functions in double to everything that adds up, and positions, which are
/// off by a few ulp of the distance, to optical depths.
double RayEnclosure::rounding(const Rgb& behind, double distance) const {
  constexpr double kRelative = 1e-10;
  double brightest = largest(m_brightest_fog), per_metre = 0.0, glow = 0.0;
  for (size_t m = 0; m < m_world.media.size(); ++m) {
    const WorldMedium& medium = m_world.media[m];
    const double sky = largest(medium.albedo * larger(medium.ambient.bottom, medium.ambient.top));
    brightest += sky;
    for (size_t l = 0; l < m_lights; ++l)
      brightest += largest(m_brightest[m * m_lights + l]) + largest(m_darkest[m * m_lights + l]);
    per_metre += medium.extinction * medium.density->max_density();
    const double seen =
        medium.extinction > 0.0 ? std::min(1.0 / medium.extinction, column_of(m)) : column_of(m);
    glow += largest(medium.emission) * seen;
  }
  const double opaque = opacity_from_tau(m_profile.tau());
  const double off = per_metre * position_error(distance);
  const double radiance = brightest * opaque + glow + largest(behind);
  return kRelative * radiance + std::min(1.0, off) * (radiance + brightest) +
         opaque * std::min(m_steepest * off, brightest);
}

double RayEnclosure::column_of(size_t m) const {
  double sum = 0.0;
  for (size_t i = 0; i < m_profile.spans().size(); ++i) sum += m_profile.column(i, m);
  return sum;
}

}  // namespace pileus
