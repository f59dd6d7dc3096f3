#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lib/freeform/deformation.h"
#include "lib/freeform/join.h"
#include "lib/freeform/quadric.h"

namespace pileus {

/// factor max(0, Q)³, added to a function: a bump where factor > 0, a dent where it is < 0 (METHODS 4.2).
struct Perturbation {
  Quadric quadric;
  double factor = 1.0;  ///< any sign
};

/// One function made of others: a node of a tree that lies flat in post-order.
struct FormNode {
  enum class Kind : uint8_t { quadric, perturbed, joined, morphed, deformed };
  Kind kind = Kind::quadric;
  Join join = Join::unite;
  int a = -1, b = -1;        ///< operands: earlier nodes
  int first = 0, count = 0;  ///< the quadric, the perturbations, or the deformation
  Blend blend;               ///< joined
  double beta = 0.0;         ///< morphed: (1 - beta) a + beta b, 0 <= beta <= 1
  int keys = -1;             ///< morphed: what makes beta of time; -1 where nothing does
};

/// A free form as its evaluators read it. The last node is the form.
struct FormProgram {
  std::vector<FormNode> nodes;
  std::vector<Quadric> quadrics;
  std::vector<Perturbation> perturbations;
  std::vector<Deformation> deformations;  ///< the operand lives in coordinates of the deformation's frame
  std::vector<std::vector<Vec2d>> keys;   ///< [time, beta] pairs, times ascending

  int root() const { return int(nodes.size()) - 1; }
  std::span<const Perturbation> perturbations_of(const FormNode& node) const {
    return {perturbations.data() + node.first, size_t(node.count)};
  }
};

/// Evaluates a node in an algebra: a type `Value` with what makes one out of quadrics and other values, and
/// the algebra for the space before a deformation.
template <class Algebra>
typename Algebra::Value evaluate(const FormProgram& program, int index, const Algebra& algebra) {
  const FormNode& node = program.nodes[size_t(index)];
  const auto operand = [&](int of) { return evaluate(program, of, algebra); };
  switch (node.kind) {
    case FormNode::Kind::quadric:
      return algebra.quadric(program.quadrics[size_t(node.first)]);
    case FormNode::Kind::perturbed:
      return algebra.perturbed(operand(node.a), program.perturbations_of(node));
    case FormNode::Kind::joined:
      return algebra.joined(node, operand(node.a), operand(node.b));
    case FormNode::Kind::deformed: {
      const Deformation& deformation = program.deformations[size_t(node.first)];
      return algebra.deformed(deformation, evaluate(program, node.a, algebra.before(deformation)));
    }
    case FormNode::Kind::morphed:
      return algebra.morphed(node, operand(node.a), operand(node.b));
  }
  return {};
}

/// The beta of a morph at a time: linear between the [time, beta] pairs, constant before and after.
double beta_at(const std::vector<Vec2d>& keys, double time);

/// The function of a node at a point.
double evaluate_at(const FormProgram& program, int index, const Vec3d& p);

template <class Algebra>
typename Algebra::Value evaluate(const FormProgram& program, const Algebra& algebra) {
  return evaluate(program, program.root(), algebra);
}

}  // namespace pileus
