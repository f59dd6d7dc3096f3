#pragma once

#include <cmath>
#include <string>

#include "lib/cloud/cloud_recipe.h"
#include "lib/math/interval.h"

namespace pileus {

/// How the density of a cloud follows from the free form f, the noises n and d (0 .. 1) and factors:
///   depth    = f / (1 + sqrt(1 - f))               0 on the surface, 1 in the centre of an ellipsoid
///   coverage = smoothstep(depth / edge) * factors
///   carved   = coverage - erosion * (1 - n)²       the noise moves the boundary instead of fading it
///   frayed   = carved - detail_erosion * (1 - d)² * (1 - carved)    most where the cloud is thin
///   x        = sharpness * (frayed - threshold) / (1 - threshold), clamped to 0 .. 1
///   rho      = x (linear), x² (3 - 2 x) (smooth), or 1 where x > 0 (hard)
/// (METHODS 9.1 for the remap.) Every step rises with what it is made of, so that ends give ranges. In single
/// precision too: T is float or double.
struct CloudFormula {
  enum class Falloff { linear, smooth, hard };
  double edge, erosion, detail_erosion, threshold, sharpness;
  Falloff falloff;

  explicit CloudFormula(const CloudRecipe& recipe)
      : edge(recipe.edge),
        erosion(recipe.erosion),
        detail_erosion(recipe.detail_erosion),
        threshold(recipe.threshold),
        sharpness(recipe.sharpness),
        falloff(recipe.falloff == "smooth" ? Falloff::smooth
                : recipe.falloff == "hard" ? Falloff::hard
                                           : Falloff::linear) {}

  template <class T>
  static T clamped(T x) {
    return x < T(0) ? T(0) : x > T(1) ? T(1) : x;
  }

  template <class T>
  static T smoothstep(T x) {
    return x * x * (T(3) - T(2) * x);
  }

  /// Of coverage, before the factors.
  template <class T>
  T coverage(T f) const {
    const T beyond = T(1) - f;
    const T depth = f / (T(1) + std::sqrt(beyond > T(0) ? beyond : T(0)));
    return smoothstep(clamped(depth / T(edge)));
  }

  template <class T>
  T carved(T coverage, T n) const {
    const T valley = T(1) - n;
    return coverage - T(erosion) * valley * valley;
  }

  template <class T>
  T frayed(T carved, T d) const {
    const T valley = T(1) - d;
    return carved - T(detail_erosion) * valley * valley * (T(1) - clamped(carved));
  }

  template <class T>
  T linear(T frayed) const {
    return clamped(T(sharpness) * (frayed - T(threshold)) / T(1 - threshold));
  }

  template <class T>
  T density(T frayed) const {
    const T x = linear(frayed);
    if (falloff == Falloff::hard) return x > T(0) ? T(1) : T(0);
    return falloff == Falloff::smooth ? smoothstep(x) : x;
  }

  /// From here on the density is 1.
  double saturation() const {
    return falloff == Falloff::hard ? threshold : threshold + (1 - threshold) / sharpness;
  }

  /// What rounding to single precision does to `frayed` at most, that of the noise included.
  double margin() const { return 4e-5 * (1 + erosion) * (1 + detail_erosion); }
};

}  // namespace pileus
