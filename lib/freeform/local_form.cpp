#include "lib/freeform/local_form.h"

#include <algorithm>
#include <cmath>

#include "lib/core/error.h"
#include "lib/freeform/form_bounds.h"
#include "lib/freeform/kernels/form_kernel.h"

namespace pileus {

namespace {

/// Single precision ends here; what may reach it has no bound.
constexpr double kFloatLimit = 1e37;

FloatQuadric to_float(const QuadricCoefficients& q, double factor) {
  return {float(q.a44), float(q.a14), float(q.a24), float(q.a34), float(q.a11), float(q.a22),
          float(q.a33), float(q.a12), float(q.a13), float(q.a23), float(factor)};
}

bool fits_float(const QuadricCoefficients& q, double factor) {
  return q.magnitude(Vec3d(1.0)) + std::fabs(factor) < kFloatLimit;
}

Vec3d middle_of(const Box3d& box) {
  return box.min * 0.5 + box.max * 0.5;
}

}  // namespace

LocalForm::LocalForm(const FormProgram& program, const Box3d& box_world) : m_anchor(middle_of(box_world)) {
  m_range = add(program, program.root(), box_world, m_anchor).range;
  if (!m_fits_float || !(m_range.magnitude() < kFloatLimit)) m_range = Interval::everything();
}

LocalForm::Mark LocalForm::mark() const {
  return {m_program.nodes.size(), m_program.quadrics.size(), m_program.perturbations.size(),
          m_program.deformations.size()};
}

void LocalForm::drop_after(const Mark& mark) {
  m_program.nodes.resize(mark.nodes);
  m_program.quadrics.resize(mark.quadrics);
  m_quadrics.resize(mark.quadrics);
  m_program.perturbations.resize(mark.perturbations);
  m_perturbations.resize(mark.perturbations);
  m_program.deformations.resize(mark.deformations);
  m_deformations.resize(mark.deformations);
}

LocalForm::Part LocalForm::add(const FormProgram& program, int index, const Box3d& box, const Vec3d& anchor) {
  FormNode node = program.nodes[size_t(index)];
  const auto push = [&](const Interval& range) {
    m_program.nodes.push_back(node);
    return Part{m_program.root(), range};
  };
  switch (node.kind) {
    case FormNode::Kind::quadric: {
      const Quadric& quadric = program.quadrics[size_t(node.first)];
      const QuadricInBox local = quadric.about(anchor, box);
      node.first = int(m_quadrics.size());
      m_program.quadrics.push_back(quadric);
      m_quadrics.push_back(to_float(local.about_center, 0.0));
      m_fits_float &= fits_float(local.about_center, 0.0);
      return push(local.range(kFloatRoundoff));
    }
    case FormNode::Kind::perturbed: {
      const Part base = add(program, node.a, box, anchor);
      const std::span<const Perturbation> all = program.perturbations_of(node);
      PerturbedRange range(base.range);
      node.a = base.root;
      node.first = int(m_perturbations.size());
      for (const Perturbation& bump : all) {
        const QuadricInBox local = bump.quadric.about(anchor, box);
        const Interval q = local.range(kFloatRoundoff);
        if (!(q.hi > 0)) continue;
        range.add(q, bump.factor);
        m_program.perturbations.push_back(bump);
        m_perturbations.push_back(to_float(local.about_center, bump.factor));
        m_fits_float &= fits_float(local.about_center, bump.factor);
      }
      node.count = int(m_perturbations.size()) - node.first;
      if (node.count == 0) return base;
      return push(range.sum(kFloatRoundoff));
    }
    case FormNode::Kind::joined: {
      const Part a = add(program, node.a, box, anchor);
      const Mark before_b = mark();
      const Part b = add(program, node.b, box, anchor);
      const bool is_sharp = node.blend.is_sharp();
      const bool is_union = node.join == Join::unite, is_common = node.join == Join::intersect;
      const double b_lower = node.join == Join::subtract ? -b.range.hi : b.range.lo;
      const bool a_decides = is_union ? a.range.lo >= b.range.hi : a.range.hi <= b_lower;
      const bool b_decides = is_union    ? b.range.lo >= a.range.hi
                             : is_common ? b.range.hi <= a.range.lo
                                         : false;
      if (is_sharp && a_decides) {
        drop_after(before_b);
        return a;
      }
      if (is_sharp && b_decides) return b;
      node.a = a.root;
      node.b = b.root;
      return push(joined_range(node, a.range, b.range, kFloatRoundoff));
    }
    case FormNode::Kind::morphed: {
      const Part a = add(program, node.a, box, anchor);
      const Part b = add(program, node.b, box, anchor);
      node.a = a.root;
      node.b = b.root;
      return push(morphed_range(node, a.range, b.range, kFloatRoundoff));
    }
    case FormNode::Kind::deformed: {
      const Deformation& deformation = program.deformations[size_t(node.first)];
      const Box3d origins = deformation.origins(box, kFloatRoundoff);
      const Vec3d origin_anchor = middle_of(origins);
      const Frame& frame = deformation.frame();
      const Part operand = add(program, node.a, origins, origin_anchor);
      node.a = operand.root;
      node.first = int(m_deformations.size());
      m_program.deformations.push_back(deformation);
      m_deformations.push_back({{Vec3f(frame.row(0)), Vec3f(frame.row(1)), Vec3f(frame.row(2))},
                                Vec3f(frame.local_point(anchor)),
                                Vec3f(origin_anchor)});
      return push(operand.range);
    }
  }
  return {-1, Interval::everything()};
}

void LocalForm::values(std::span<const float> x, std::span<const float> y, std::span<const float> z,
                       std::span<float> f) const {
  FormPoints points;
  for (size_t start = 0; start < f.size(); start += FormPoints::kMost) {
    points.count = std::min(FormPoints::kMost, f.size() - start);
    std::copy_n(x.data() + start, points.count, points.x);
    std::copy_n(y.data() + start, points.count, points.y);
    std::copy_n(z.data() + start, points.count, points.z);
    evaluate_points(*this, points, f.subspan(start, points.count));
  }
}

void LocalForm::values(const PointLattice& lattice, std::span<float> f) const {
  PILEUS_CHECK(f.size() == lattice.size());
  const Vec3d first = lattice.first - m_anchor;
  FormPoints points;
  size_t start = 0;
  const auto flush = [&] {
    evaluate_points(*this, points, f.subspan(start, points.count));
    start += points.count;
    points.count = 0;
  };
  for (int i = 0; i < lattice.count.x; ++i) {
    for (int j = 0; j < lattice.count.y; ++j) {
      const float x = float(first.x + lattice.step.x * i), y = float(first.y + lattice.step.y * j);
      for (int k = 0; k < lattice.count.z; ++k) {
        points.x[points.count] = x;
        points.y[points.count] = y;
        points.z[points.count] = float(first.z + lattice.step.z * k);
        if (++points.count == FormPoints::kMost) flush();
      }
    }
  }
  if (points.count > 0) flush();
}

}  // namespace pileus
