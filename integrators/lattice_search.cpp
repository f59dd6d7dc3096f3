#include "integrators/lattice_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "integrators/lamp_lattice.h"
#include "integrators/march_places.h"
#include "integrators/sun_lattice.h"

namespace pileus {
namespace {

/// Depth beyond which no light changes a pilot's pixel by more than `least`.
float enough_depth(const Pilots& pilots, const MarchWorld& march, double least) {
  if (pilots.empty()) return SunLattice::kDeepest;
  float depth = 1.0f;
  const auto is_enough = [&](const std::vector<float>& weights) {
    for (size_t l = 0; l < march.suns().size(); ++l) {
      const double beyond =
          change_of_light(march, weights, l, double(depth), std::numeric_limits<double>::infinity());
      if (std::abs(beyond) > least / double(march.suns().size())) return false;
    }
    return true;
  };
  for (const PilotRay& pilot : pilots) {
    for (const PilotPoint& point : pilot.points) {
      while (depth < SunLattice::kDeepest && !is_enough(point.weights)) depth += 0.5f;
      if (!march.has_lamps()) break;  // the same at all
    }
  }
  // One more, because balancing lowers depths near the deepest a little.
  return std::min(depth + 1.0f, SunLattice::kDeepest);
}

/// What lattices may be like, and what they have cost.
struct LatticeTrial {
  LatticeOptions options;
  double bytes = 0.0;
};

/// A grid as it stands in the places of a kind.
MarchGrid grid_of(const MarchScene& scene, const MarchKind& kind) {
  MarchGrid grid = scene.grids[kind.grid];
  grid.local_from_world = kind.local_from_world;
  return grid;
}

/// Up to some more than `most`.
double bytes_of(const MarchWorld& march, const LatticeOptions& options, double most) {
  double bytes = 0.0;
  for (size_t l = 0; l < march.suns().size(); ++l) {
    const MarchLamp* const lamp = march.kernel.lamp(l);
    for (const MarchKind& kind : march.kernel.kinds) {
      const MarchGrid grid = grid_of(march.kernel, kind);
      bytes += lamp ? lamp_faces_bytes(grid, lamp->position, options)
                    : sun_lattice_bytes(grid, march.suns()[l].wi, options);
      if (bytes > most) return bytes;
    }
  }
  return bytes;
}

/// Adds the lattice of a grid for a light; false where memory does not suffice.
bool add_lattice(const MarchKind& kind, size_t light, const LatticeOptions& options, MarchWorld& march,
                 double& bytes) {
  const MarchGrid grid = grid_of(march.kernel, kind);
  SunLattice& lattice = march.kernel.lattices.emplace_back();
  for (MarchLamp& lamp : march.kernel.lamps) {
    if (lamp.light != int(light)) continue;
    bool fits = true;
    lamp.faces.push_back(build_lamp_faces(grid, lamp.position, options, fits));
    for (const LampFace& face : lamp.faces.back()) bytes += double(face.depths.memory_bytes());
    return fits;
  }
  lattice = build_sun_lattice(grid, march.suns()[light].wi, options);
  bytes += double(lattice.memory_bytes());
  return lattice.bricks.x > 0;
}

/// False where memory does not suffice.
bool build_lattices(MarchWorld& march, LatticeTrial& trial) {
  clear_lattices(march);
  trial.bytes = 0.0;
  for (size_t l = 0; l < march.suns().size(); ++l) {
    for (const MarchKind& kind : march.kernel.kinds) {
      LatticeOptions options = trial.options;
      options.most_bytes -= trial.bytes;
      if (!add_lattice(kind, l, options, march, trial.bytes)) return false;
    }
  }
  return true;
}

/// Along the light the depth bends less: only the density's own gradient does it.
LatticeSpacing spaced(double across) {
  constexpr double kAlong = 1.5;
  return {across, kAlong * across};
}

/// How the error depends on the spacing, as far as it has been measured.
class ErrorLaw {
 public:
  void add(double spacing, double error) {
    m_spacing = spacing;
    m_error = error;
  }

  /// The spacing that would err by `allowed` where another errs by `error`. Down to a voxel the error falls
  /// as the grid's details have it; what is finer finds nothing new, and errs as linear interpolation does.
  double spacing_for(double spacing, double error, double allowed) const {
    constexpr double kVoxel = 1.0, kBelowVoxel = 2.5;
    const double power = power_at(spacing, error), needed = spacing * std::pow(allowed / error, 1.0 / power);
    if (needed >= kVoxel) return needed;
    const double from = std::min(spacing, kVoxel), error_from = error * std::pow(from / spacing, power);
    return from * std::pow(std::min(1.0, allowed / error_from), 1.0 / kBelowVoxel);
  }

 private:
  double power_at(double spacing, double error) const {
    constexpr double kUsual = 1.7, kLeast = 1.7, kMost = 2.5;  // little where there are details of all sizes
    if (!(m_spacing > 0.0)) return kUsual;
    return std::clamp(std::log(error / m_error) / std::log(spacing / m_spacing), kLeast, kMost);
  }

  double m_spacing = 0.0, m_error = 0.0;  ///< measured before
};

/// What lattices of a spacing would say, of a world in which each grid stands but once.
class LatticeProbe {
 public:
  LatticeProbe(const MarchWorld& march, const LatticeOptions& options) : m_kinds(march.kernel.kinds.size()) {
    for (const Illumination& sun : march.suns()) {
      for (const MarchGrid& grid : march.kernel.grids) m_lattices.emplace_back(grid, sun.wi, options);
    }
  }

  double depth(size_t light, const Vec3d& p) const {
    double depth = 0.0;
    for (size_t kind = 0; kind < m_kinds; ++kind) depth += m_lattices[light * m_kinds + kind].depth(p);
    return depth;
  }

 private:
  size_t m_kinds;
  std::vector<SunProbe> m_lattices;  ///< [light][kind]
};

/// Looks for lattices that are good enough, and not much better: a first one is coarse and costs little; from
/// what it errs follows about how fine they have to be; what lattices near that would err is found out at the
/// pilot points alone, where they can be probed. Else lattices are built until one is good enough.
class LatticeSearch {
 public:
  /// trace: makes pilots
  LatticeSearch(const std::function<Pilots(int points)>& trace, double tolerance, double most_bytes,
                MarchWorld& march)
      : m_trace(trace),
        m_march(march),
        m_pilots(trace(kFewPoints)),
        m_reserve(kEnoughShare * tolerance),
        m_allowed(tolerance - m_reserve) {
    m_trial.options.most_bytes = most_bytes;
    m_trial.options.is_everywhere = march.kernel.media() > 1 || !march.kernel.places.empty();
    m_trial.options.enough = enough_depth(m_pilots, march, m_reserve);
  }

  /// False where memory ends first.
  bool run(SunlightChoice& choice) {
    constexpr int kRounds = 5;
    constexpr double kFirst = 4.0;
    choice.spacing = kFirst;
    for (int round = 0; round < kRounds && is_possible(choice.spacing); ++round) {
      if (!build(choice.spacing)) return false;
      double error = lattice_error();
      if (error > enough() && look_closer(needed(choice.spacing, error))) error = lattice_error();
      choice.error = error + m_reserve;
      if (error <= enough()) {
        choice.reason = fmt::format(
            "optical depth on lattices of {:.2g} by {:.2g} voxels, {:.1f} MB: estimated error {:.2g}",
            m_trial.options.spacing.across, m_trial.options.spacing.along, 1e-6 * m_trial.bytes,
            choice.error);
        return true;
      }
      choice.spacing = next_spacing(round, choice.spacing, error);
    }
    return false;
  }

 private:
  static constexpr double kEnoughShare = 0.02;
  static constexpr double kFinest = 0.1;  ///< spacing across [cells]
  // To shorten all steps a little costs less than another lattice.
  static constexpr double kGoodEnough = 1.15;

  double enough() const { return kGoodEnough * m_allowed; }

  LatticeOptions options_of(double spacing) const {
    LatticeOptions options = m_trial.options;
    options.spacing = spaced(spacing);
    return options;
  }

  bool takes_more(double spacing, double bytes) const {
    return bytes_of(m_march, options_of(spacing), bytes) > bytes;
  }

  bool is_possible(double spacing) const {
    return spacing >= kFinest && !takes_more(spacing, 2.0 * m_trial.options.most_bytes);
  }

  bool build(double spacing) {
    m_trial.options = options_of(spacing);
    return build_lattices(m_march, m_trial);
  }

  double lattice_error() const {
    return measured_error(m_pilots, m_march,
                          [&](size_t l, const Vec3d& p) { return lattice_depth(m_march.kernel, l, p); });
  }

  double needed(double spacing, double error) const { return m_law.spacing_for(spacing, error, m_allowed); }

  /// Lets the pilots tell as much as lattices of a spacing ask for; false where they do already.
  bool look_closer(double spacing) {
    constexpr double kFine = 2.5;      // spacing from which on many points tell more,
    constexpr double kFiner = 0.8;     // from which on steps of half a cell are too long to judge by,
    constexpr double kVeryFine = 0.4;  // and from which on any are
    const Closeness wanted = spacing < kVeryFine ? Closeness::exact
                             : spacing < kFiner  ? Closeness::fine
                             : spacing < kFine   ? Closeness::many
                                                 : Closeness::few;
    if (wanted <= m_closeness) return false;
    if (m_closeness == Closeness::few) m_pilots = m_trace(kManyPoints);
    if (wanted == Closeness::fine) take_fine_depths(m_march, m_pilots);
    if (wanted == Closeness::exact) take_exact_depths(m_march, m_pilots);
    m_closeness = wanted;
    return true;
  }

  double next_spacing(int round, double spacing, double error) {
    // Measured errors scatter by a fifth, by where lines happen to lie: a little finer might be no better. A
    // long way is gone in two steps: the first costs little and tells where the second has to go.
    constexpr double kFinerAtLeast = 0.88, kCautious = 0.92, kConfident = 0.98, kLongWay = 0.3;
    const double wanted = needed(spacing, error), coarsest = 0.98 * std::min(spacing, SunProbe::kCoarsest);
    m_law.add(spacing, error);
    const bool is_far = round == 0 && wanted < kLongWay * spacing;
    const double next = is_far ? std::sqrt(wanted * spacing) : wanted;
    if (next < coarsest && can_probe(next)) return probed_spacing(next, coarsest);
    return std::min(is_far ? next : next * (round == 0 ? kCautious : kConfident), kFinerAtLeast * spacing);
  }

  /// Few probes take a few milliseconds. A lattice takes one or two for each MB.
  bool can_probe(double spacing) const {
    constexpr double kWorthwhile = 6e6;
    return m_march.kernel.places.empty() && !m_march.has_lamps() && is_possible(spacing) &&
           takes_more(spacing, kWorthwhile);
  }

  /// The spacing below `coarsest`, from about `needed` on, whose lattices err as much as they may: from
  /// coarse to fine, because what is finer costs more.
  double probed_spacing(double needed, double coarsest) {
    constexpr int kProbes = 4;
    constexpr double kCoarser = 1.1, kNear = 0.87, kBarely = 1.05, kUsual = 2.0, kLeast = 1.5, kMost = 3.0;
    double next = kCoarser * needed, good = 0.0, power = kUsual;
    double before = 0.0, error_before = 0.0;
    for (int probe = 0; probe < kProbes; ++probe) {
      next = std::min(next, coarsest);
      look_closer(next);
      const double error = std::max(probed_error(next), 1e-3 * m_allowed);  // what none errs has no power law
      if (error <= kBarely * m_allowed) good = std::max(good, next);
      if (error <= kBarely * m_allowed && error >= kNear * m_allowed) break;
      if (before > 0.0 && before != next)
        power = std::clamp(std::log(error / error_before) / std::log(next / before), kLeast, kMost);
      before = next, error_before = error;
      next *= std::pow(m_allowed / error, 1.0 / power);
      if (!is_possible(next)) break;
    }
    return good > 0.0 ? good : next;
  }

  double probed_error(double spacing) const {
    const LatticeProbe probe(m_march, options_of(spacing));
    return measured_error(m_pilots, m_march, [&](size_t l, const Vec3d& p) { return probe.depth(l, p); });
  }

  /// How well the pilots tell.
  enum class Closeness { few, many, fine, exact };

  std::function<Pilots(int points)> m_trace;
  MarchWorld& m_march;
  Pilots m_pilots;
  Closeness m_closeness = Closeness::few;
  double m_reserve, m_allowed;
  LatticeTrial m_trial;
  ErrorLaw m_law;
};

}  // namespace

void clear_lattices(MarchWorld& march) {
  march.kernel.lattices.clear();
  for (MarchLamp& lamp : march.kernel.lamps) lamp.faces.clear();
}

bool find_lattices(const std::function<Pilots(int points)>& trace, double tolerance, double most_bytes,
                   MarchWorld& march, SunlightChoice& choice) {
  return LatticeSearch(trace, tolerance, most_bytes, march).run(choice);
}

}  // namespace pileus
