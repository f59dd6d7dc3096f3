#include "lib/scene/free_form_recipe.h"

#include <algorithm>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "lib/core/param_table.h"
#include "lib/freeform/form_program.h"

namespace pileus {

namespace {

double radians(double degrees) {
  return degrees * (std::numbers::pi / 180.0);
}

}  // namespace

void FreeFormRecipe::describe(ParamTable& params) {
  params.group(
      "base",
      [this](ParamTable& p) {
        m_base.describe(p, {"form"});
        p.reference("form", m_copy, kSection, "another free form, to be changed here");
      },
      "the solid to begin with");
  const char* helps[] = {"all of these free forms", "what these free forms have in common",
                         "the first of these free forms without the others"};
  for (size_t i = 0; i < m_joins.size(); ++i) {
    params.references(m_joins[i].name, m_joins[i].operands, kSection, helps[i]);
  }
  params.group(
      "morph", [this](ParamTable& p) { describe_morph(p); }, "something between two free forms");
  params.exactly_one_of({"base", "union", "intersection", "difference", "morph"});

  params
      .number("smooth", m_blend.smooth, "1",
              "rounds the edges of a union, intersection or difference: 0 sharp")
      .at_least(0);
  params.number("alpha", m_blend.alpha, "1", "1: maximum and minimum; 0: Rvachev's functions")
      .at_least(0)
      .at_most(1);
  params.group_list(
      "perturb", [this](ParamTable& p) { describe_bump(p); }, "bumps and dents");
  params.group_list(
      "deform", [this](ParamTable& p) { describe_deformation(p); },
      "deformations of the whole, in this order");
  params.group(
      "place", [this](ParamTable& p) { m_placement.describe(p); }, "where the whole is put, last");
}

void FreeFormRecipe::describe_morph(ParamTable& params) {
  params.reference("from", m_from, kSection, "the free form at beta = 0").required();
  params.reference("to", m_to, kSection, "the free form at beta = 1").required();
  params.number("beta", m_beta, "1", "how much of `to`").at_least(0).at_most(1);
  params.points("beta_over_time", m_beta_over_time, "s, 1",
                "[time, beta] pairs instead of one beta; linear in between");
}

void FreeFormRecipe::describe_bump(ParamTable& params) {
  recipe::Bump& bump = m_bumps.emplace_back();
  bump.quadric.describe(params);
  params.number("factor", bump.factor, "1", "form factor: > 0 a bump, < 0 a dent");
}

void FreeFormRecipe::describe_deformation(ParamTable& params) {
  recipe::Deformed& deformation = m_deformations.emplace_back();
  const auto describe_range = [&deformation](ParamTable& p) {
    p.vector("center", deformation.center, "m", "where the distance along the axis is 0");
    p.vector("axis", deformation.axis, "", "direction along which the form changes");
    p.number("from", deformation.from, "m", "distance along the axis where it begins to");
    p.number("to", deformation.to, "m", "where it ends, > from");
  };
  params.group(
      "twist",
      [=, &deformation](ParamTable& p) {
        deformation.kind = Deformation::Kind::twist;
        describe_range(p);
        p.number("angle_deg", deformation.angle_deg, "deg", "by how much the far end is turned");
      },
      "turns about the axis");
  params.group(
      "bend",
      [=, &deformation](ParamTable& p) {
        deformation.kind = Deformation::Kind::bend;
        describe_range(p);
        p.vector("towards", deformation.towards, "", "the side to which the axis bends");
        p.number("angle_deg", deformation.angle_deg, "deg", "between the axis at its two ends")
            .above(-360)
            .below(360);
      },
      "bends the axis to an arc");
  params.group(
      "taper",
      [=, &deformation](ParamTable& p) {
        deformation.kind = Deformation::Kind::taper;
        describe_range(p);
        p.number("factor", deformation.factor, "1", "width of the far end over that of the near end")
            .above(0);
      },
      "widens or narrows along the axis");
  params.exactly_one_of({"twist", "bend", "taper"});
}

void FreeFormRecipe::check(std::vector<std::string>& problems) const {
  m_base.check(problems);
  for (const recipe::Joined& joined : m_joins) {
    if (joined.operands.size() == 1) {
      problems.push_back(fmt::format("{} names only \"{}\"; expected at least two free forms", joined.name,
                                     joined.operands[0]));
    }
  }
  for (size_t i = 0; i < m_beta_over_time.size(); ++i) {
    const Vec2d& key = m_beta_over_time[i];
    if (!(0 <= key.y && key.y <= 1)) {
      problems.push_back(fmt::format("morph: beta_over_time has beta = {}; expected 0 <= beta <= 1", key.y));
    }
    if (i > 0 && !(m_beta_over_time[i - 1].x < key.x)) {
      problems.push_back(
          fmt::format("morph: beta_over_time has the time {} after {}; expected times that increase", key.x,
                      m_beta_over_time[i - 1].x));
    }
  }
  for (size_t i = 0; i < m_bumps.size(); ++i) {
    std::vector<std::string> own;
    m_bumps[i].quadric.check(own);
    for (const std::string& problem : own) problems.push_back(fmt::format("perturb {}: {}", i + 1, problem));
  }
  for (size_t i = 0; i < m_deformations.size(); ++i) {
    const std::string problem = m_deformations[i].problem();
    if (!problem.empty()) problems.push_back(fmt::format("deform {}: {}", i + 1, problem));
  }
}

std::string recipe::Deformed::problem() const {
  if (!(from < to)) return fmt::format("from = {} and to = {}; expected from < to", from, to);
  if (!(length(axis) > 0)) return "axis is zero; expected a direction";
  const bool leads_nowhere = length(cross(normalize(axis), towards)) < 1e-9 * length(towards);
  if (kind == Deformation::Kind::bend && (leads_nowhere || !(length(towards) > 0))) {
    return "towards is zero or along the axis; expected a direction across it";
  }
  return "";
}

Deformation recipe::Deformed::deformation() const {
  switch (kind) {
    case Deformation::Kind::twist:
      return Deformation::twist(center, axis, from, to, radians(angle_deg));
    case Deformation::Kind::bend:
      return Deformation::bend(center, axis, towards, from, to, radians(angle_deg));
    case Deformation::Kind::taper:
      return Deformation::taper(center, axis, from, to, factor);
  }
  return {};
}

std::vector<std::string> FreeFormRecipe::operands() const {
  std::vector<std::string> names;
  for (const std::string& name : {m_copy, m_from, m_to}) {
    if (!name.empty()) names.push_back(name);
  }
  for (const recipe::Joined& joined : m_joins)
    names.insert(names.end(), joined.operands.begin(), joined.operands.end());
  return names;
}

FreeForm FreeFormRecipe::source(const std::map<std::string, FreeForm>& known) const {
  if (!m_copy.empty()) return known.at(m_copy);
  if (!m_from.empty()) {
    if (!m_beta_over_time.empty()) return morphed(known.at(m_from), known.at(m_to), m_beta_over_time);
    return morphed(known.at(m_from), known.at(m_to), m_beta);
  }
  for (const recipe::Joined& joins : m_joins) {
    if (joins.operands.empty()) continue;
    FreeForm form = known.at(joins.operands[0]);
    for (size_t i = 1; i < joins.operands.size(); ++i) {
      form = joined(joins.join, form, known.at(joins.operands[i]), m_blend);
    }
    return form;
  }
  return m_base.quadric();
}

FreeForm FreeFormRecipe::form(const std::map<std::string, FreeForm>& known) const {
  FreeForm form = source(known);
  std::vector<Perturbation> perturbations;
  for (const recipe::Bump& bump : m_bumps) perturbations.push_back({bump.quadric.quadric(), bump.factor});
  if (!perturbations.empty()) form = perturbed(form, perturbations);
  for (const recipe::Deformed& deformation : m_deformations) {
    form = deformed(form, deformation.deformation());
  }
  const Placement unmoved;
  const bool is_placed = m_placement.scale != unmoved.scale || m_placement.rotate_deg != unmoved.rotate_deg ||
                         m_placement.translate != unmoved.translate;
  return is_placed ? placed(form, m_placement.world_from_object()) : form;
}

namespace {

/// More functions than this in one form are a mistake: a chain of forms that each double the one before.
constexpr size_t kMostFunctions = 20000;

size_t function_count(const FreeForm& form) {
  return form.program().nodes.size() + form.program().perturbations.size();
}

/// Goes through recipes so that operands come first.
class RecipeWalk {
 public:
  explicit RecipeWalk(const FreeFormRecipes& recipes) : m_recipes(recipes) {}

  /// Names in an order in which operands precede; those of a cycle are missing.
  const std::vector<std::string>& order() {
    for (const auto& entry : m_recipes) visit(entry.first);
    return m_order;
  }
  const std::optional<FreeFormCycle>& cycle() const { return m_cycle; }

 private:
  bool visit(const std::string& name) {
    if (m_done.contains(name)) return m_done.at(name);
    m_path.push_back(name);
    bool is_sound = true;
    for (const std::string& operand : m_recipes.at(name).operands()) {
      if (!m_recipes.contains(operand)) continue;
      const auto start = std::find(m_path.begin(), m_path.end(), operand);
      if (start != m_path.end()) {
        if (!m_cycle) {
          m_cycle = {name, operand, fmt::format("{}, {}", fmt::join(start, m_path.end(), ", "), operand)};
        }
        is_sound = false;
      } else {
        is_sound &= visit(operand);
      }
    }
    m_path.pop_back();
    m_done[name] = is_sound;
    if (is_sound) m_order.push_back(name);
    return is_sound;
  }

  const FreeFormRecipes& m_recipes;
  std::map<std::string, bool> m_done;
  std::vector<std::string> m_path, m_order;
  std::optional<FreeFormCycle> m_cycle;
};

}  // namespace

std::optional<FreeFormCycle> find_cycle(const FreeFormRecipes& recipes) {
  RecipeWalk walk(recipes);
  walk.order();
  return walk.cycle();
}

FreeForms make_free_forms(const FreeFormRecipes& recipes, std::vector<std::string>& too_large) {
  FreeForms forms;
  RecipeWalk walk(recipes);
  for (const std::string& name : walk.order()) {
    const FreeFormRecipe& recipe = recipes.at(name);
    size_t count = 0;
    for (const std::string& operand : recipe.operands()) {
      const auto found = forms.find(operand);
      count += found == forms.end() ? kMostFunctions : function_count(found->second);
    }
    if (count >= kMostFunctions) {
      too_large.push_back(name);
    } else {
      forms.emplace(name, recipe.form(forms));
    }
  }
  return forms;
}

}  // namespace pileus
