#pragma once

#include <array>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "lib/freeform/deformation.h"
#include "lib/freeform/free_form.h"
#include "lib/freeform/join.h"
#include "lib/scene/medium.h"
#include "lib/scene/quadric_recipe.h"

namespace pileus {

namespace recipe {

struct Bump {
  QuadricRecipe quadric;
  double factor = 1.0;
};
struct Deformed {
  Deformation::Kind kind = Deformation::Kind::twist;
  Vec3d center{0.0}, axis{0.0, 1.0, 0.0}, towards{1.0, 0.0, 0.0};
  double from = 0.0, to = 1.0, angle_deg = 90.0, factor = 0.5;

  std::string problem() const;  ///< what is wrong, or ""
  Deformation deformation() const;
};
struct Joined {
  Join join;
  std::string name;
  std::vector<std::string> operands{};
};

}  // namespace recipe

/// What a scene says about a free form, `[freeform.NAME]`: what it is made of, then what is done to that, in
/// this order:
///   base = { ellipsoid = { ... } } | union = ["a", "b"] | intersection = [...] | difference = [...] |
///   morph = { from = "a", to = "b", beta = 0.5 }
///   perturb = [ { sphere = { ... }, factor = 0.8 }, ... ]
///   deform  = [ { twist = { ... } }, ... ]
///   place   = { scale = [...], rotate_deg = [...], translate = [...] }
/// docs/freeform.md is the manual.
class FreeFormRecipe {
 public:
  static constexpr const char* kSection = "freeform";

  void describe(ParamTable& params);

  /// Appends a sentence for everything wrong that no single parameter's range can tell.
  void check(std::vector<std::string>& problems) const;

  /// Names of the free forms that this one is made of.
  std::vector<std::string> operands() const;

  /// The form; check() had no complaint, and `known` holds all operands.
  FreeForm form(const std::map<std::string, FreeForm>& known) const;

 private:
  void describe_morph(ParamTable& params);
  void describe_bump(ParamTable& params);
  void describe_deformation(ParamTable& params);
  FreeForm source(const std::map<std::string, FreeForm>& known) const;

  QuadricRecipe m_base;
  std::string m_copy, m_from, m_to;  ///< names of free forms; "" where the scene has none
  std::array<recipe::Joined, 3> m_joins{recipe::Joined{Join::unite, "union"},
                                        recipe::Joined{Join::intersect, "intersection"},
                                        recipe::Joined{Join::subtract, "difference"}};
  Blend m_blend;
  double m_beta = 0.5;
  std::vector<Vec2d> m_beta_over_time;
  std::deque<recipe::Bump> m_bumps;
  std::deque<recipe::Deformed> m_deformations;
  Placement m_placement;
};

using FreeFormRecipes = std::map<std::string, FreeFormRecipe>;

/// A free form that is made of itself and the operand through which it is; nothing where none is.
struct FreeFormCycle {
  std::string name, operand;
  std::string path;  ///< "a, b, a"
};
std::optional<FreeFormCycle> find_cycle(const FreeFormRecipes& recipes);

/// Makes forms that refer to each other: all operands are there, none is made of itself. Those that grow out
/// of bounds, because each doubles the one before, are left out and named.
FreeForms make_free_forms(const FreeFormRecipes& recipes, std::vector<std::string>& too_large);

}  // namespace pileus
