#include "lib/scene/quadric_recipe.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "lib/core/overload.h"
#include "lib/core/param_table.h"
#include "lib/freeform/shapes.h"

namespace pileus {

namespace {

/// The round shapes, what their centre is called, and what they are.
struct RoundShape {
  const char *name, *center, *help;
};
constexpr RoundShape kRoundShapes[] = {
    {"cylinder", "center", "1 - r², endless along its axis"},
    {"cone", "apex", "z² - r², both halves, endless"},
    {"paraboloid", "vertex", "z - r², opens along its axis"},
    {"hyperboloid", "center", "1 - r² + z² (1 sheet) or z² - r² - 1 (2 sheets)"},
};

bool is_direction(const Vec3d& v) {
  return length(v) > 0 && std::isfinite(length(v));
}

}  // namespace

void QuadricRecipe::describe(ParamTable& params, const std::vector<std::string>& other_choices) {
  std::vector<std::string> names{"ellipsoid", "sphere"};
  params.group(
      "ellipsoid",
      [this](ParamTable& p) {
        recipe::Ellipsoid& shape = m_shape.emplace<recipe::Ellipsoid>();
        p.vector("center", shape.center, "m", "centre");
        p.vector("radii", shape.radii, "m", "half axes along x, y and z").above(0);
      },
      "1 - x² - y² - z² in units of the radii");
  params.group(
      "sphere",
      [this](ParamTable& p) {
        recipe::Sphere& shape = m_shape.emplace<recipe::Sphere>();
        p.vector("center", shape.center, "m", "centre");
        p.number("radius", shape.radius, "m", "radius").above(0);
      },
      "1 - r² in units of the radius");
  for (const RoundShape& round : kRoundShapes) {
    names.push_back(round.name);
    params.group(
        round.name, [this, name = round.name](ParamTable& p) { describe_round(p, name); }, round.help);
  }
  names.insert(names.end(), {"plane", "plane_pair", "coefficients"});
  params.group(
      "plane",
      [this](ParamTable& p) {
        recipe::Plane& shape = m_shape.emplace<recipe::Plane>();
        p.vector("point", shape.point, "m", "a point of the plane");
        p.vector("normal", shape.normal, "", "direction that leads out of the solid");
        p.number("size", shape.size, "m", "distance behind the plane at which the function is 1").above(0);
      },
      "the half space behind a plane");
  params.group(
      "plane_pair",
      [this](ParamTable& p) {
        recipe::PlanePair& shape = m_shape.emplace<recipe::PlanePair>();
        p.vector("center", shape.center, "m", "a point half way between the planes");
        p.vector("normal", shape.normal, "", "direction across them");
        p.number("thickness", shape.thickness, "m", "distance from one to the other").above(0);
      },
      "the slab between two parallel planes");
  params.group(
      "coefficients",
      [this](ParamTable& p) {
        recipe::Coefficients& shape = m_shape.emplace<recipe::Coefficients>();
        p.vector("center", shape.center, "m", "where the local coordinates x, y and z are 0");
        p.vector("size", shape.size, "m", "where they are 1").above(0);
        QuadricCoefficients& a = shape.a;
        const std::pair<const char*, double*> terms[] = {
            {"a11", &a.a11}, {"a22", &a.a22}, {"a33", &a.a33}, {"a12", &a.a12}, {"a13", &a.a13},
            {"a23", &a.a23}, {"a14", &a.a14}, {"a24", &a.a24}, {"a34", &a.a34}, {"a44", &a.a44}};
        const char* of[] = {"x²", "y²", "z²", "xy", "xz", "yz", "x", "y", "z", "1"};
        for (size_t i = 0; i < std::size(terms); ++i) {
          p.number(terms[i].first, *terms[i].second, "", fmt::format("coefficient of {}", of[i]));
        }
      },
      "any quadric, by its coefficients");
  names.insert(names.end(), other_choices.begin(), other_choices.end());
  params.exactly_one_of(std::move(names));
}

void QuadricRecipe::describe_round(ParamTable& params, const std::string& shape_name) {
  recipe::Round& shape = m_shape.emplace<recipe::Round>();
  shape.shape = shape_name;
  const auto& known = *std::find_if(std::begin(kRoundShapes), std::end(kRoundShapes),
                                    [&](const RoundShape& round) { return shape_name == round.name; });
  params.vector(known.center, shape.center, "m", "where z and r are 0");
  params.vector("axis", shape.axis, "", "direction of z");
  params.number("radius", shape.radius, "m", "where r is 1").above(0);
  if (shape_name == "cylinder") return;
  params.number("height", shape.height, "m", "where z is 1").above(0);
  if (shape_name == "hyperboloid") {
    params.integer("sheets", shape.sheets, "1: a waist; 2: two bowls").at_least(1).at_most(2);
  }
}

void QuadricRecipe::check(std::vector<std::string>& problems) const {
  const auto demand = [&](const Vec3d& direction, const std::string& of) {
    if (!is_direction(direction)) problems.push_back(of + " is zero; expected a direction");
  };
  std::visit(Overload{
                 [&](const recipe::Round& shape) { demand(shape.axis, shape.shape + ": axis"); },
                 [&](const recipe::Plane& shape) { demand(shape.normal, "plane: normal"); },
                 [&](const recipe::PlanePair& shape) { demand(shape.normal, "plane_pair: normal"); },
                 [](const auto&) {},
             },
             m_shape);
}

Quadric QuadricRecipe::quadric() const {
  return std::visit(
      Overload{
          [](const recipe::Ellipsoid& shape) { return ellipsoid(shape.center, shape.radii); },
          [](const recipe::Sphere& shape) { return sphere(shape.center, shape.radius); },
          [](const recipe::Round& shape) {
            if (shape.shape == "cylinder") return cylinder(shape.center, shape.axis, shape.radius);
            if (shape.shape == "cone") return cone(shape.center, shape.axis, shape.radius, shape.height);
            if (shape.shape == "paraboloid")
              return paraboloid(shape.center, shape.axis, shape.radius, shape.height);
            const auto sheets = shape.sheets == 1 ? hyperboloid_of_one_sheet : hyperboloid_of_two_sheets;
            return sheets(shape.center, shape.axis, shape.radius, shape.height);
          },
          [](const recipe::Plane& shape) { return plane(shape.point, shape.normal, shape.size); },
          [](const recipe::PlanePair& shape) {
            return plane_pair(shape.center, shape.normal, shape.thickness);
          },
          [](const recipe::Coefficients& shape) { return Quadric(Frame(shape.center, shape.size), shape.a); },
      },
      m_shape);
}

}  // namespace pileus
