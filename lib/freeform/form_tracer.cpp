#include "lib/freeform/form_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <variant>

#include "lib/freeform/form_bounds.h"
#include "lib/freeform/joined_form.h"
#include "lib/math/beam.h"
#include "lib/math/box.h"

namespace pileus {

namespace {

constexpr double kPrecision = 0x1p-20;  ///< of subdivision, in units of the stretch in a form's bounds

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kUndecided = std::numeric_limits<double>::quiet_NaN();
constexpr double kNotAsked = -kNever;

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
    : m_method(method), m_root(make(form.program(), form.program().root())) {
  if (method == TraceMethod::newton) add_operands(*m_root, {});
}

FormTracer::~FormTracer() = default;

/// What is taken from a union is taken from each of its parts.
void FormTracer::add_operands(const Node& node, const std::vector<Box3d>& taken_bounds) {
  if (!node.leaf && node.join == Join::unite) {
    add_operands(*node.a, taken_bounds);
    add_operands(*node.b, taken_bounds);
    return;
  }
  if (!node.leaf && node.join == Join::subtract) {
    std::vector<Box3d> all_taken = taken_bounds;
    all_taken.push_back(node.b->bounds);
    add_operands(*node.a, all_taken);
    return;
  }
  const PlainForm* plain = node.leaf ? std::get_if<PlainForm>(&*node.leaf) : nullptr;
  Operand operand{&node, plain, {}, taken_bounds};
  if (plain) {
    // So much wider than where it acts that no ray outside could think it acts, for all its rounding.
    const double size = length(node.bounds.max - node.bounds.min) + length(node.bounds.max);
    for (const FormTerm& term : plain->perturbations()) {
      Box3d box = term.quadric.bounds();
      const Vec3d margin(1e-9 * (length(box.max - box.min) + size));
      operand.perturbation_bounds.push_back({box.min - margin, box.max + margin});
    }
  }
  m_operands.push_back(std::move(operand));
}

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

/// True where a ray that meets an operand may pass through what is taken from it: the whole form has to tell.
bool FormTracer::may_be_taken(const Operand& operand, const Ray& ray, Segment segment) {
  return std::any_of(operand.taken_bounds.begin(), operand.taken_bounds.end(),
                     [&](const Box3d& box) { return !clip_to_box(ray, segment, box).empty(); });
}

bool FormTracer::may_start_inside(const Operand& operand, const Ray& ray, const Segment& segment) {
  const Vec3d p = ray.at(segment.t0);
  if (!operand.node->bounds.intersects(p)) return false;
  const FormAtPoint form = at(*operand.node, p);
  return form.value >= -form.margin;
}

std::vector<Box3d> FormTracer::part_bounds() const {
  if (m_operands.empty()) return {m_root->bounds};
  std::vector<Box3d> bounds;
  for (const Operand& operand : m_operands) bounds.push_back(operand.node->bounds);
  return bounds;
}

void FormTracer::cross(const Operand& operand, std::span<const Ray> rays, std::span<const Segment> segments,
                       Asked asked, std::span<double> t) const {
  CrossingRays packet;
  std::array<size_t, CrossingRays::kMost> numbers;
  std::array<Segment, CrossingRays::kMost> stretches;
  Beam beam;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (std::isnan(t[i]) || t[i] == kNotAsked) continue;
    if (asked == Asked::whether && t[i] != kNever) {
      // What another operand has found is no crossing of the union where the ray is in this one, too.
      if (may_start_inside(operand, rays[i], segments[i])) t[i] = kUndecided;
      continue;
    }
    const Segment clipped =
        clip_to_box(rays[i], {segments[i].t0, std::min(segments[i].t1, t[i])}, operand.node->bounds);
    if (!(clipped.t0 < clipped.t1) || !std::isfinite(clipped.length())) continue;
    if (!operand.plain) {
      TraceWork work;
      const Segments found = inside(*operand.node, rays[i], segments[i], work);
      if (found.empty()) continue;
      const double at = found.front().t0;
      const bool is_decided = at > segments[i].t0 && !may_be_taken(operand, rays[i], {segments[i].t0, at});
      t[i] = is_decided ? std::min(t[i], at) : kUndecided;
      continue;
    }
    const StretchList stretch(clipped, true);
    numbers[packet.count] = i;
    stretches[packet.count] = clipped;
    packet.add(AnchoredRay(rays[i], stretch.middle()), stretch.local());
    beam.o.extendBy(rays[i].o);
    beam.d.extendBy(rays[i].d);
  }
  if (packet.count == 0) return;

  const std::span<const FormTerm> all = operand.plain->perturbations();
  thread_local std::vector<const FormTerm*> near;
  near.clear();
  for (size_t k = 0; k < all.size(); ++k) {
    if (!beam.inside(operand.perturbation_bounds[k]).empty()) near.push_back(&all[k]);
  }
  find_crossings(operand.plain->base(), near, asked, packet);
  for (size_t n = 0; n < packet.count; ++n) {
    double& nearest = t[numbers[n]];
    if (packet.t[n] == kNever) continue;
    if (asked == Asked::whether || !std::isfinite(packet.t[n])) {
      const bool is_decided = !may_be_taken(operand, rays[numbers[n]], stretches[n]);
      nearest = is_decided ? packet.t[n] : kUndecided;
      continue;
    }
    StretchList found(stretches[n], true);
    found.sign_from(found.local().t0, false);
    found.sign_from(packet.t[n], true);
    const double at = *found.first();
    const Segment& segment = segments[numbers[n]];
    if (!(at > segment.t0) || may_be_taken(operand, rays[numbers[n]], {segment.t0, at})) {
      nearest = kUndecided;
    } else if (at < std::min(segment.t1, nearest)) {
      nearest = at;
    }
  }
}

void FormTracer::cross(std::span<const Ray> rays, std::span<const Segment> segments, Asked asked,
                       std::span<double> t) const {
  Beam beam;
  for (const Ray& ray : rays) {
    beam.o.extendBy(ray.o);
    beam.d.extendBy(ray.d);
  }
  if (m_operands.empty()) std::replace(t.begin(), t.end(), kNever, kUndecided);
  for (const Operand& operand : m_operands) {
    if (beam.inside(operand.node->bounds).empty()) continue;
    for (size_t first = 0; first < rays.size(); first += CrossingRays::kMost) {
      const size_t count = std::min(CrossingRays::kMost, rays.size() - first);
      cross(operand, rays.subspan(first, count), segments.subspan(first, count), asked,
            t.subspan(first, count));
    }
  }
  for (size_t i = 0; i < rays.size(); ++i) {
    if (std::isnan(t[i])) t[i] = first_crossing(rays[i], segments[i]).value_or(kNever);
  }
}

void FormTracer::first_crossings(std::span<const Ray> rays, std::span<const Segment> segments,
                                 std::span<double> t) const {
  std::fill(t.begin(), t.end(), kNever);
  cross(rays, segments, Asked::where, t);
}

void FormTracer::find_met(std::span<const Ray> rays, std::span<const Segment> segments,
                          std::span<char> met) const {
  thread_local std::vector<double> t;
  t.resize(rays.size());
  for (size_t i = 0; i < rays.size(); ++i) t[i] = met[i] ? kNotAsked : kNever;
  cross(rays, segments, Asked::whether, t);
  for (size_t i = 0; i < rays.size(); ++i) met[i] = t[i] != kNever;
}

Segments inside(const FreeForm& form, const Ray& ray, const Segment& segment) {
  return FormTracer(form).inside(ray, segment);
}

}  // namespace pileus
