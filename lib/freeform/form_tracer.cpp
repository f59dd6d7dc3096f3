#include "lib/freeform/form_tracer.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "lib/freeform/form_bounds.h"
#include "lib/freeform/joined_form.h"
#include "lib/math/box.h"

namespace pileus {

namespace {

constexpr double kPrecision = 0x1p-20;  ///< of subdivision, in units of the stretch in a form's bounds

/// The form of a node on its own: nodes are in post-order, so what comes later is not part of it.
FormProgram part(const FormProgram& program, int index) {
  FormProgram result = program;
  result.nodes.resize(size_t(index) + 1);
  return result;
}

/// A bit larger: bounds are to rounding.
Box3d widened(const Box3d& box) {
  if (box.isEmpty()) return box;
  Vec3d margin;
  for (int axis = 0; axis < 3; ++axis) {
    margin[axis] = 1e-9 * (box.max[axis] - box.min[axis]) +
                   1e-15 * std::max(std::fabs(box.min[axis]), std::fabs(box.max[axis]));
  }
  return {box.min - margin, box.max + margin};
}

}  // namespace

/// A sharp join of two, or a function to be solved as one.
struct FormTracer::Node {
  Box3d bounds;
  Join join = Join::unite;
  std::unique_ptr<Node> a, b;
  std::optional<std::variant<PlainForm, JoinedForm>> leaf;
};

std::unique_ptr<FormTracer::Node> FormTracer::make(const FormProgram& program, int index) {
  const FormNode& node = program.nodes[size_t(index)];
  auto result = std::make_unique<Node>();
  result->bounds = widened(solid_bounds(part(program, index)));
  if (node.kind == FormNode::Kind::joined && node.blend.is_sharp()) {
    result->join = node.join;
    result->a = make(program, node.a);
    result->b = make(program, node.b);
  } else if (auto plain = PlainForm::from(program, index)) {
    result->leaf = std::move(*plain);
  } else {
    result->leaf = JoinedForm(part(program, index));
  }
  return result;
}

FormTracer::FormTracer(const FreeForm& form, TraceMethod method)
    : m_method(method), m_root(make(form.program(), form.program().root())) {}

FormTracer::~FormTracer() = default;

void FormTracer::trace(const Node& leaf, const Ray& ray, const Segment& segment, const Segment& clipped,
                       StretchList& found, TraceWork& work) const {
  const AnchoredRay anchored(ray, found.middle());
  const Segment local = found.local();
  if (clipped.t0 > segment.t0) found.sign_from(local.t0, false);
  std::visit(
      [&](const auto& form) {
        if (m_method == TraceMethod::newton) {
          form.trace(anchored, local, found, work);
        } else {
          form.subdivide(anchored, local, local.length() * kPrecision, found, work);
        }
      },
      *leaf.leaf);
  if (clipped.t1 < segment.t1 && !found.is_done()) found.sign_from(local.t1, false);
}

Segments FormTracer::inside(const Node& node, const Ray& ray, const Segment& segment, TraceWork& work) const {
  const Segment clipped = clip_to_box(ray, segment, node.bounds);
  if (!(clipped.t0 < clipped.t1) || !std::isfinite(clipped.length())) return {};
  if (node.leaf) {
    StretchList found(clipped, false);
    trace(node, ray, segment, clipped, found, work);
    return found.finish();
  }
  const Segments a = inside(*node.a, ray, clipped, work);
  if (a.empty() && node.join != Join::unite) return a;
  const Segments b = inside(*node.b, ray, clipped, work);
  switch (node.join) {
    case Join::unite:
      return unite(a, b);
    case Join::intersect:
      return intersect(a, b);
    case Join::subtract:
      return subtract(a, b);
  }
  return {};
}

FormAtPoint FormTracer::at(const Node& node, const Vec3d& p) {
  if (node.leaf) return std::visit([&](const auto& form) { return form.at(p); }, *node.leaf);
  // What does not reach the point is below 0 there: nothing of a union, and nothing that is taken away.
  const bool a_reaches = node.a->bounds.intersects(p), b_reaches = node.b->bounds.intersects(p);
  if (node.join == Join::unite && a_reaches != b_reaches) return at(a_reaches ? *node.a : *node.b, p);
  const FormAtPoint a = at(*node.a, p);
  if (node.join == Join::subtract && !b_reaches) return a;
  FormAtPoint b = at(*node.b, p);
  if (node.join == Join::subtract) {
    b.value = -b.value;
    b.gradient = -b.gradient;
  }
  const bool takes_a = node.join == Join::unite ? a.value >= b.value : a.value <= b.value;
  return takes_a ? a : b;
}

FormAtPoint FormTracer::at(const Vec3d& p) const {
  return at(*m_root, p);
}

Segments FormTracer::inside(const Ray& ray, const Segment& segment, TraceWork* work) const {
  TraceWork ignored;
  return inside(*m_root, ray, segment, work ? *work : ignored);
}

std::optional<double> FormTracer::first_crossing(const Ray& ray, const Segment& segment,
                                                 TraceWork* work) const {
  TraceWork ignored;
  const auto crossing_in_segment = [&](double t) { return segment.t0 < t && t < segment.t1; };
  if (m_root->leaf) {
    const Segment clipped = clip_to_box(ray, segment, m_root->bounds);
    if (!(clipped.t0 < clipped.t1) || !std::isfinite(clipped.length())) return std::nullopt;
    StretchList found(clipped, true);
    trace(*m_root, ray, segment, clipped, found, work ? *work : ignored);
    if (found.first() && crossing_in_segment(*found.first())) return found.first();
    return std::nullopt;
  }
  for (const Segment& part : inside(ray, segment, work)) {
    if (crossing_in_segment(part.t0)) return part.t0;
    if (crossing_in_segment(part.t1)) return part.t1;
  }
  return std::nullopt;
}

Segments inside(const FreeForm& form, const Ray& ray, const Segment& segment) {
  return FormTracer(form).inside(ray, segment);
}

}  // namespace pileus
