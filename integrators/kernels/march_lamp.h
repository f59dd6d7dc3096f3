#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <numbers>
#include <vector>

#include "integrators/kernels/sun_nodes.h"
#include "lib/math/vec.h"

namespace pileus {

// Lights at a finite distance, lamps, as the march knows them.

/// A phase function as a table, linear between nodes in equal distances of s, from 0 straight on to sqrt(2)
/// straight back: s = sin(angle / 2) up to a right angle, sqrt(2) - cos(angle / 2) from there on. It and its
/// slope are continuous, and s is in proportion to the angle near both peaks that phase functions have.
struct PhaseTable {
  static constexpr double kWhole = std::numbers::sqrt2;
  static constexpr int kParts = 64;

  /// What is known of a part of the angles.
  struct Part {
    double most = 0.0;      ///< largest value [1/sr]
    double steepest = 0.0;  ///< largest slope with s [1/sr]
  };

  std::vector<float> values;  ///< [1/sr]; two where it is the same for all angles, else more
  double error = 0.0;         ///< of any value, relative
  std::array<Part, kParts> parts;

  bool is_constant() const { return values.size() == 2; }

  /// Of all angles between two s.
  Part between(double s0, double s1) const {
    const auto part_at = [](double s) { return std::clamp(int(s / kWhole * kParts), 0, kParts - 1); };
    Part all;
    for (int i = part_at(s0); i <= part_at(s1); ++i) {
      all.most = std::max(all.most, parts[size_t(i)].most);
      all.steepest = std::max(all.steepest, parts[size_t(i)].steepest);
    }
    return all;
  }
};

/// How a medium scatters the light of lamps: the weight of term k is flat[k] + shaped[k] * p.
struct LampPhase {
  PhaseTable table;
  std::vector<float> flat, shaped;
  double flat_sum = 0.0, shaped_sum = 0.0;  ///< of the terms that are not negative

  /// Upper bound of the response to light of irradiance 1 where p is at most this.
  double most(double p) const { return flat_sum + shaped_sum * p; }
};

/// Optical depths of a grid from a lamp, on lines that meet in it (lamp_lattice.h): part of all directions.
///   u = X / Z, v = Y / Z, w = W, Z = W + w0, with (X, Y, W) by depths.lattice_from_world
struct LampFace {
  SunLattice depths;
  double w0 = 0.0;
  double lo_u, hi_u, lo_v, hi_v;  ///< directions beyond these are none of its
};

struct MarchLamp {
  int light = 0;                             ///< its number among all lights
  Vec3d position;                            ///< world
  double radius = 0.0;                       ///< below this distance the irradiance stays the same [m]
  std::vector<float> strengths;              ///< [medium]: strongest channel of albedo * intensity [W/sr]
  std::vector<std::vector<LampFace>> faces;  ///< [grid]; where lattices hold the depths
};

}  // namespace pileus
