#include "lib/freeform/form_bounds.h"

#include <algorithm>
#include <cmath>

namespace pileus {

namespace {

double cube(double x) {
  return x * x * x;
}

bool is_finite(const Box3d& box) {
  return std::isfinite(box.min.x) && std::isfinite(box.min.y) && std::isfinite(box.min.z) &&
         std::isfinite(box.max.x) && std::isfinite(box.max.y) && std::isfinite(box.max.z);
}

Box3d hull(Box3d a, const Box3d& b) {
  if (!b.isEmpty()) a.extendBy(b);
  return a;
}

Box3d common(Box3d a, const Box3d& b) {
  for (int axis = 0; axis < 3; ++axis) {
    a.min[axis] = std::max(a.min[axis], b.min[axis]);
    a.max[axis] = std::min(a.max[axis], b.max[axis]);
  }
  return a.isEmpty() ? Box3d() : a;
}

/// A level -l such that a blended union below -level has both operands below -l.
double level_of_operands(double level, const Blend& blend) {
  if (blend.is_sharp()) return level;
  // Of operands -x and less the union is at most that of -x twice:
  // (sqrt(2 (1 - alpha) x² + smooth²) - 2 x) / (1 + alpha) <= (smooth - (2 - sqrt(2 (1 - alpha))) x) / ...
  return ((1 + blend.alpha) * level + blend.smooth) / (2 - std::sqrt(2 * (1 - blend.alpha)));
}

/// A box around the part of {node >= -level} in `clip`.
Box3d rough_bounds(const FormProgram& program, int index, double level, const Box3d& clip) {
  const FormNode& node = program.nodes[size_t(index)];
  switch (node.kind) {
    case FormNode::Kind::quadric:
      return program.quadrics[size_t(node.first)].bounds(level, clip);
    case FormNode::Kind::perturbed: {
      // Outside of the solid only a bump makes more of it, and only where it acts.
      Box3d box = rough_bounds(program, node.a, level, clip);
      for (const Perturbation& bump : program.perturbations_of(node)) {
        if (bump.factor > 0) box = hull(box, bump.quadric.bounds(0.0, clip));
      }
      return box;
    }
    case FormNode::Kind::joined: {
      if (node.join == Join::unite) {
        const double inner = level_of_operands(level, node.blend);
        return hull(rough_bounds(program, node.a, inner, clip), rough_bounds(program, node.b, inner, clip));
      }
      // A blended intersection is never above either operand.
      const Box3d box = rough_bounds(program, node.a, level, clip);
      if (node.join == Join::subtract || box.isEmpty()) return box;
      return common(box, rough_bounds(program, node.b, level, box));
    }
    case FormNode::Kind::morphed:  // nowhere above both operands
      return hull(rough_bounds(program, node.a, level, clip), rough_bounds(program, node.b, level, clip));
    case FormNode::Kind::deformed: {
      const Deformation& deformation = program.deformations[size_t(node.first)];
      return common(deformation.image(rough_bounds(program, node.a, level, everywhere())), clip);
    }
  }
  return clip;
}

/// Leaves out the cells of a box in which the form is below 0.
class Shrinker {
 public:
  explicit Shrinker(const FormProgram& program) : m_program(program) {}

  Box3d shrunk(const Box3d& box) {
    visit(box, kDepth);
    return m_hull;
  }

 private:
  static constexpr int kDepth = 6;

  void visit(const Box3d& box, int depth) {
    const bool adds_nothing = !m_hull.isEmpty() && m_hull.intersects(box.min) && m_hull.intersects(box.max);
    if (adds_nothing || evaluate(m_program, BoxAlgebra{box}).hi < 0) return;
    if (depth == 0) {
      m_hull.extendBy(box);
      return;
    }
    const Vec3d middle = box.center();
    for (int child = 0; child < 8; ++child) {
      Box3d part = box;
      for (int axis = 0; axis < 3; ++axis) (child >> axis & 1 ? part.min : part.max)[axis] = middle[axis];
      visit(part, depth - 1);
    }
  }

  const FormProgram& m_program;
  Box3d m_hull;
};

}  // namespace

double beta_at(const std::vector<Vec2d>& points, double x) {
  const auto after = std::upper_bound(points.begin(), points.end(), x,
                                      [](double value, const Vec2d& point) { return value < point.x; });
  if (after == points.begin()) return points.front().y;
  if (after == points.end()) return points.back().y;
  const Vec2d &a = *(after - 1), &b = *after;
  return a.y + (b.y - a.y) * ((x - a.x) / (b.x - a.x));
}

Interval betas_of(const FormProgram& program, const FormNode& node, double time0, double time1) {
  if (node.keys < 0) return {node.beta, node.beta};
  const std::vector<Vec2d>& keys = program.keys[size_t(node.keys)];
  const double first = beta_at(keys, time0), last = beta_at(keys, time1);
  Interval betas{std::min(first, last), std::max(first, last)};
  for (const Vec2d& key : keys) {
    if (time0 < key.x && key.x < time1) betas = hull(betas, {key.y, key.y});
  }
  return betas;
}

void PerturbedRange::add(const Interval& q, double factor) {
  const double low = cube(std::max(0.0, q.lo)), high = cube(std::max(0.0, q.hi));
  m_sum.lo += factor * (factor > 0 ? low : high);
  m_sum.hi += factor * (factor > 0 ? high : low);
  m_magnitude += std::fabs(factor) * high;
  ++m_terms;
}

Interval joined_range(const FormNode& node, const Interval& a, const Interval& b, double u) {
  if (std::isinf(a.magnitude()) || std::isinf(b.magnitude())) {
    if (!node.blend.is_sharp()) return Interval::everything();
  }
  const bool falls = node.join == Join::subtract;
  const Interval ends{join(node.join, a.lo, falls ? b.hi : b.lo, node.blend),
                      join(node.join, a.hi, falls ? b.lo : b.hi, node.blend)};
  if (node.blend.is_sharp()) return ends;
  return ends.widened(16 * u * (ends.magnitude() + node.blend.smooth));
}

Interval morphed_range(const FormNode& node, const Interval& a, const Interval& b, double u) {
  const double beta = node.beta, rest = 1 - beta;
  const Interval sum{rest * a.lo + beta * b.lo, rest * a.hi + beta * b.hi};
  return sum.widened(8 * u * (rest * a.magnitude() + beta * b.magnitude()));
}

Interval BoxAlgebra::perturbed(const Interval& base, std::span<const Perturbation> perturbations) const {
  PerturbedRange range(base);
  for (const Perturbation& bump : perturbations) range.add(bump.quadric.range(box), bump.factor);
  return range.sum(kDoubleRoundoff);
}

Box3d solid_bounds(const FormProgram& program) {
  constexpr int kRounds = 3;  // what one operand of an intersection leaves tells the other more
  Box3d box = everywhere();
  for (int round = 0; round < kRounds && !box.isEmpty(); ++round) {
    box = rough_bounds(program, program.root(), 0.0, box);
  }
  const bool is_exact = program.nodes.size() == 1;
  if (is_exact || box.isEmpty() || !is_finite(box)) return box;
  return Shrinker(program).shrunk(box);
}

}  // namespace pileus
