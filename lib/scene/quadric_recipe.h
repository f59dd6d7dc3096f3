#pragma once

#include <string>
#include <variant>
#include <vector>

#include "lib/freeform/quadric.h"
#include "lib/math/vec.h"

namespace pileus {

class ParamTable;

namespace recipe {

struct Ellipsoid {
  Vec3d center{0.0}, radii{1.0};
};
struct Sphere {
  Vec3d center{0.0};
  double radius = 1.0;
};
/// Cylinder, cone, paraboloid and hyperboloid.
struct Round {
  std::string shape;
  Vec3d center{0.0}, axis{0.0, 1.0, 0.0};
  double radius = 1.0, height = 1.0;
  int sheets = 1;
};
struct Plane {
  Vec3d point{0.0}, normal{0.0, 1.0, 0.0};
  double size = 1.0;
};
struct PlanePair {
  Vec3d center{0.0}, normal{0.0, 1.0, 0.0};
  double thickness = 1.0;
};
struct Coefficients {
  Vec3d center{0.0}, size{1.0};
  QuadricCoefficients a{0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
};

}  // namespace recipe

/// What a scene says about a quadric: exactly one of the shapes of lib/freeform/shapes.h by name, or
/// coefficients.
class QuadricRecipe {
 public:
  /// Declares a table for each shape; the one that the scene gives is kept. With them stands whatever else
  /// may be chosen in their place.
  void describe(ParamTable& params, const std::vector<std::string>& other_choices = {});

  /// Appends a sentence for everything wrong that no single parameter's range can tell.
  void check(std::vector<std::string>& problems) const;

  /// The quadric; check() had no complaint.
  Quadric quadric() const;

 private:
  void describe_round(ParamTable& params, const std::string& shape);

  std::variant<recipe::Ellipsoid, recipe::Sphere, recipe::Round, recipe::Plane, recipe::PlanePair,
               recipe::Coefficients>
      m_shape;
};

}  // namespace pileus
