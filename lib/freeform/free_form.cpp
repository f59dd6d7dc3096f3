#include "lib/freeform/free_form.h"

#include <algorithm>
#include <mutex>
#include <span>
#include <utility>

#include "lib/core/error.h"
#include "lib/freeform/form_bounds.h"
#include "lib/freeform/form_program.h"
#include "lib/freeform/local_form.h"
#include "lib/math/affine.h"

namespace pileus {

namespace {

struct PointAlgebra {
  using Value = double;
  Vec3d p;

  double quadric(const Quadric& quadric) const { return quadric.value(p); }
  double perturbed(double f, std::span<const Perturbation> perturbations) const {
    for (const Perturbation& bump : perturbations) {
      const double q = bump.quadric.value(p);
      if (q > 0) f += bump.factor * q * q * q;
    }
    return f;
  }
  double joined(const FormNode& node, double a, double b) const { return join(node.join, a, b, node.blend); }
  double morphed(const FormNode& node, double a, double b) const {
    return (1 - node.beta) * a + node.beta * b;
  }
  PointAlgebra before(const Deformation& deformation) const { return {deformation.origin(p)}; }
  double deformed(const Deformation&, double operand) const { return operand; }
};

struct ValueAndGradient {
  double f = 0.0;
  Vec3d gradient{0.0};
};

struct GradientAlgebra {
  using Value = ValueAndGradient;
  Vec3d p;

  Value quadric(const Quadric& quadric) const { return {quadric.value(p), quadric.gradient(p)}; }
  Value perturbed(Value v, std::span<const Perturbation> perturbations) const {
    for (const Perturbation& bump : perturbations) {
      const double q = bump.quadric.value(p);
      if (!(q > 0)) continue;
      v.f += bump.factor * q * q * q;
      v.gradient += 3 * bump.factor * q * q * bump.quadric.gradient(p);
    }
    return v;
  }
  Value joined(const FormNode& node, const Value& a, const Value& b) const {
    const JoinSlopes slopes = join_slopes(node.join, a.f, b.f, node.blend);
    return {join(node.join, a.f, b.f, node.blend), slopes.a * a.gradient + slopes.b * b.gradient};
  }
  Value morphed(const FormNode& node, const Value& a, const Value& b) const {
    const double beta = node.beta, rest = 1 - beta;
    return {rest * a.f + beta * b.f, rest * a.gradient + beta * b.gradient};
  }
  GradientAlgebra before(const Deformation& deformation) const { return {deformation.origin(p)}; }
  Value deformed(const Deformation& deformation, const Value& operand) const {
    return {operand.f, deformation.gradient(p, operand.gradient)};
  }
};

/// Appends a program and returns its root.
int append(FormProgram& to, const FormProgram& from) {
  const int node_shift = int(to.nodes.size()), quadric_shift = int(to.quadrics.size()),
            perturbation_shift = int(to.perturbations.size()), key_shift = int(to.keys.size()),
            deformation_shift = int(to.deformations.size());
  for (FormNode node : from.nodes) {
    if (node.a >= 0) node.a += node_shift;
    if (node.b >= 0) node.b += node_shift;
    if (node.keys >= 0) node.keys += key_shift;
    node.first += node.kind == FormNode::Kind::quadric    ? quadric_shift
                  : node.kind == FormNode::Kind::deformed ? deformation_shift
                                                          : perturbation_shift;
    to.nodes.push_back(node);
  }
  to.quadrics.insert(to.quadrics.end(), from.quadrics.begin(), from.quadrics.end());
  to.perturbations.insert(to.perturbations.end(), from.perturbations.begin(), from.perturbations.end());
  to.deformations.insert(to.deformations.end(), from.deformations.begin(), from.deformations.end());
  to.keys.insert(to.keys.end(), from.keys.begin(), from.keys.end());
  return to.root();
}

/// Replaces everything that stands in the space of the form itself, not in one before a deformation.
template <class Move>
void move_all(FormProgram& program, int index, const Move& move) {
  const FormNode& node = program.nodes[size_t(index)];
  const auto replace = [&](auto& item) { item = move(item); };
  switch (node.kind) {
    case FormNode::Kind::quadric:
      return replace(program.quadrics[size_t(node.first)]);
    case FormNode::Kind::deformed:
      return replace(program.deformations[size_t(node.first)]);
    case FormNode::Kind::perturbed:
      for (int i = 0; i < node.count; ++i) replace(program.perturbations[size_t(node.first + i)].quadric);
      return move_all(program, node.a, move);
    case FormNode::Kind::joined:
    case FormNode::Kind::morphed:
      move_all(program, node.a, move);
      return move_all(program, node.b, move);
  }
}

}  // namespace

double evaluate_at(const FormProgram& form, int index, const Vec3d& p) {
  return evaluate(form, index, PointAlgebra{p});
}

/// What copies of a form share. Bounds take a while and are not asked of forms that become part of others.
struct FreeForm::Shared {
  FormProgram program;
  std::once_flag has_bounds;
  Box3d bounds;
};

FreeForm::FreeForm(FormProgram form) : m_shared(std::make_shared<Shared>()) {
  m_shared->program = std::move(form);
}

const FormProgram& FreeForm::program() const {
  return m_shared->program;
}

const Box3d& FreeForm::bounds() const {
  std::call_once(m_shared->has_bounds, [this] { m_shared->bounds = solid_bounds(program()); });
  return m_shared->bounds;
}

FreeForm::FreeForm() : FreeForm(Quadric()) {}

FreeForm::FreeForm(const Quadric& base) : m_shared(std::make_shared<Shared>()) {
  m_shared->program.quadrics.push_back(base);
  m_shared->program.nodes.emplace_back();
}

double FreeForm::value(const Vec3d& p_world) const {
  return evaluate_at(program(), program().root(), p_world);
}

Vec3d FreeForm::gradient(const Vec3d& p_world) const {
  return evaluate(program(), GradientAlgebra{p_world}).gradient;
}

Interval FreeForm::range(const Box3d& box_world) const {
  return evaluate(program(), BoxAlgebra{box_world});
}

LocalForm FreeForm::within(const Box3d& box_world) const {
  return LocalForm(program(), box_world);
}

Interval range_over_time(const FreeForm& form, const Box3d& box_world, double time0, double time1) {
  return evaluate(form.program(), BoxAlgebra{box_world, &form.program(), time0, time1});
}

bool FreeForm::changes_over_time() const {
  return !program().keys.empty();
}

FreeForm FreeForm::at(double time) const {
  FormProgram moved = program();
  for (FormNode& node : moved.nodes) {
    if (node.keys >= 0) node.beta = beta_at(moved.keys[size_t(node.keys)], time);
  }
  return FreeForm(std::move(moved));
}

FreeForm perturbed(const FreeForm& form, const std::vector<Perturbation>& perturbations) {
  FormProgram program = form.program();
  FormNode node;
  node.kind = FormNode::Kind::perturbed;
  node.a = program.root();
  node.first = int(program.perturbations.size());
  node.count = int(perturbations.size());
  program.perturbations.insert(program.perturbations.end(), perturbations.begin(), perturbations.end());
  program.nodes.push_back(node);
  return FreeForm(std::move(program));
}

FreeForm joined(Join join, const FreeForm& a, const FreeForm& b, const Blend& blend) {
  FormProgram program = a.program();
  FormNode node;
  node.kind = FormNode::Kind::joined;
  node.join = join;
  node.blend = blend;
  node.a = program.root();
  node.b = append(program, b.program());
  program.nodes.push_back(node);
  return FreeForm(std::move(program));
}

FreeForm joined(Join join, const FreeForm& a, const FreeForm& b) {
  return joined(join, a, b, {});
}

FreeForm morphed(const FreeForm& from, const FreeForm& to, const std::vector<Vec2d>& beta_keys) {
  PILEUS_CHECK(!beta_keys.empty());
  FormProgram program = from.program();
  FormNode node;
  node.kind = FormNode::Kind::morphed;
  node.a = program.root();
  node.b = append(program, to.program());
  node.beta = beta_at(beta_keys, 0.0);
  if (beta_keys.size() > 1) {
    node.keys = int(program.keys.size());
    program.keys.push_back(beta_keys);
  }
  program.nodes.push_back(node);
  return FreeForm(std::move(program));
}

FreeForm morphed(const FreeForm& from, const FreeForm& to, double beta) {
  return morphed(from, to, std::vector<Vec2d>{{0.0, beta}});
}

FreeForm placed(const FreeForm& form, const Affine& world_from_form) {
  FormProgram program = form.program();
  move_all(program, program.root(), [&](const auto& item) { return item.moved(world_from_form); });
  return FreeForm(std::move(program));
}

FreeForm deformed(const FreeForm& form, const Deformation& deformation) {
  FormProgram program = form.program();
  move_all(program, program.root(), [&](const auto& item) { return item.relative_to(deformation.frame()); });
  FormNode node;
  node.kind = FormNode::Kind::deformed;
  node.a = program.root();
  node.first = int(program.deformations.size());
  program.deformations.push_back(deformation);
  program.nodes.push_back(node);
  return FreeForm(std::move(program));
}

}  // namespace pileus
