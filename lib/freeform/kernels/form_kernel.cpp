#include "lib/freeform/kernels/form_kernel.h"

#include <algorithm>

#include "lib/freeform/local_form.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "lib/freeform/kernels/form_kernel.cpp"
#include "hwy/foreach_target.h"  // compiles this file again for each target
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace pileus::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<float>;
using V = hn::Vec<D>;

/// A quadric's coefficients, one in all lanes of a vector.
struct LaneQuadric {
  V constant, x, y, z, xx, yy, zz, xy, xz, yz;

  explicit LaneQuadric(const FloatQuadric& q) {
    const D d;
    constant = hn::Set(d, q.constant);
    x = hn::Set(d, q.x), y = hn::Set(d, q.y), z = hn::Set(d, q.z);
    xx = hn::Set(d, q.xx), yy = hn::Set(d, q.yy), zz = hn::Set(d, q.zz);
    xy = hn::Set(d, q.xy), xz = hn::Set(d, q.xz), yz = hn::Set(d, q.yz);
  }

  HWY_INLINE V value(V px, V py, V pz) const {
    const V along_z = hn::MulAdd(zz, pz, z);
    const V along_y = hn::MulAdd(yz, pz, hn::MulAdd(yy, py, y));
    const V along_x = hn::MulAdd(xz, pz, hn::MulAdd(xy, py, hn::MulAdd(xx, px, x)));
    return hn::MulAdd(along_x, px, hn::MulAdd(along_y, py, hn::MulAdd(along_z, pz, constant)));
  }
};

/// The blended intersection of join.h, lane by lane; signs turn it into the other joins.
struct LaneBlend {
  V alpha, beta, smooth, twice, share;

  explicit LaneBlend(const Blend& blend) {
    const D d;
    const float a = float(blend.alpha);
    alpha = hn::Set(d, a);
    beta = hn::Set(d, 1.0f - a);
    smooth = hn::Set(d, float(blend.smooth));
    twice = hn::Set(d, 2.0f * (1.0f + a));
    share = hn::Set(d, 1.0f / (1.0f + a));
  }

  HWY_INLINE V intersection(V a, V b) const {
    const D d;
    const V least = hn::Set(d, 1e-37f);  // all 0: a quotient of 0, not NaN
    const V scale = hn::Max(hn::Max(hn::Abs(a), hn::Abs(b)), hn::Max(smooth, least));
    const V inverse = hn::Div(hn::Set(d, 1.0f), scale);
    const V x = hn::Mul(a, inverse), y = hn::Mul(b, inverse), w = hn::Mul(smooth, inverse);
    const V w2 = hn::Mul(w, w), difference = hn::Sub(x, y), sum = hn::Add(x, y);
    const V squares = hn::MulAdd(x, x, hn::Mul(y, y));
    const V root =
        hn::Sqrt(hn::MulAdd(hn::Mul(alpha, difference), difference, hn::MulAdd(beta, squares, w2)));
    const V stable = hn::Div(hn::MulSub(hn::Mul(twice, x), y, w2), hn::Max(hn::Add(sum, root), least));
    const V twofold = hn::IfThenElse(hn::Gt(sum, hn::Zero(d)), stable, hn::Sub(sum, root));
    return hn::Mul(hn::Mul(scale, share), twofold);
  }
};

class PointKernel {
 public:
  PointKernel(const LocalForm& form, const FormPoints& points) : m_form(form), m_points(points) {
    const size_t lanes = hn::Lanes(D());
    m_end = (points.count + lanes - 1) / lanes * lanes;
  }

  /// f = the node's function, over whole vectors.
  void evaluate(int index, float* f) const {
    const FormNode& node = m_form.program().nodes[size_t(index)];
    switch (node.kind) {
      case FormNode::Kind::quadric:
        return quadric(m_form.quadrics()[size_t(node.first)], f);
      case FormNode::Kind::perturbed:
        evaluate(node.a, f);
        for (int i = 0; i < node.count; ++i) perturb(m_form.perturbations()[size_t(node.first + i)], f);
        return;
      case FormNode::Kind::joined:
      case FormNode::Kind::morphed: {
        alignas(64) float other[FormPoints::kMost];
        evaluate(node.a, f);
        evaluate(node.b, other);
        node.kind == FormNode::Kind::joined ? join(node, other, f) : morph(node, other, f);
        return;
      }
      case FormNode::Kind::deformed: {
        FormPoints origins;
        origins_of(node, origins);
        return PointKernel(m_form, origins).evaluate(node.a, f);
      }
    }
  }

 private:
  void quadric(const FloatQuadric& quadric, float* f) const {
    const D d;
    const LaneQuadric q(quadric);
    for (size_t i = 0; i < m_end; i += hn::Lanes(d)) {
      hn::Store(
          q.value(hn::Load(d, m_points.x + i), hn::Load(d, m_points.y + i), hn::Load(d, m_points.z + i)), d,
          f + i);
    }
  }

  void perturb(const FloatQuadric& quadric, float* f) const {
    const D d;
    const LaneQuadric q(quadric);
    const V factor = hn::Set(d, quadric.factor);
    for (size_t i = 0; i < m_end; i += hn::Lanes(d)) {
      const V value = hn::Max(
          q.value(hn::Load(d, m_points.x + i), hn::Load(d, m_points.y + i), hn::Load(d, m_points.z + i)),
          hn::Zero(d));
      const V cubed = hn::Mul(hn::Mul(value, value), value);
      hn::Store(hn::MulAdd(cubed, factor, hn::Load(d, f + i)), d, f + i);
    }
  }

  void join(const FormNode& node, const float* b, float* f) const {
    const bool is_union = node.join == Join::unite;
    if (!node.blend.is_sharp()) {
      const LaneBlend blend(node.blend);
      if (is_union) {
        return combine(
            b, f, [blend](V x, V y) HWY_ATTR { return hn::Neg(blend.intersection(hn::Neg(x), hn::Neg(y))); });
      }
      if (node.join == Join::intersect) {
        return combine(b, f, [blend](V x, V y) HWY_ATTR { return blend.intersection(x, y); });
      }
      return combine(b, f, [blend](V x, V y) HWY_ATTR { return blend.intersection(x, hn::Neg(y)); });
    }
    if (is_union) return combine(b, f, [](V x, V y) HWY_ATTR { return hn::Max(x, y); });
    if (node.join == Join::intersect) return combine(b, f, [](V x, V y) HWY_ATTR { return hn::Min(x, y); });
    combine(b, f, [](V x, V y) HWY_ATTR { return hn::Min(x, hn::Neg(y)); });
  }

  void morph(const FormNode& node, const float* b, float* f) const {
    const D d;
    const V beta = hn::Set(d, float(node.beta)), rest = hn::Set(d, float(1 - node.beta));
    combine(b, f, [beta, rest](V x, V y) HWY_ATTR { return hn::MulAdd(beta, y, hn::Mul(rest, x)); });
  }

  /// Where a deformation took the points from, relative to its own anchor.
  void origins_of(const FormNode& node, FormPoints& origins) const {
    const Deformation& deformation = m_form.program().deformations[size_t(node.first)];
    const FloatDeformation& map = m_form.deformations()[size_t(node.first)];
    origins.count = m_points.count;
    for (size_t i = 0; i < m_points.count; ++i) {
      const Vec3f offset(m_points.x[i], m_points.y[i], m_points.z[i]);
      const Vec3f local =
          Vec3f(map.rows[0].dot(offset), map.rows[1].dot(offset), map.rows[2].dot(offset)) + map.local_anchor;
      const Vec3f origin = deformation.local_origin(local) - map.origin_anchor;
      origins.x[i] = origin.x, origins.y[i] = origin.y, origins.z[i] = origin.z;
    }
  }

  /// f[i] = operation(f[i], b[i])
  template <class Operation>
  HWY_INLINE void combine(const float* b, float* f, Operation operation) const {
    const D d;
    for (size_t i = 0; i < m_end; i += hn::Lanes(d)) {
      hn::Store(operation(hn::Load(d, f + i), hn::Load(d, b + i)), d, f + i);
    }
  }

  const LocalForm& m_form;
  const FormPoints& m_points;
  size_t m_end;  ///< points.count, rounded up to whole vectors
};

void evaluate_points_impl(const LocalForm& form, const FormPoints& points, std::span<float> f) {
  alignas(64) float values[FormPoints::kMost];
  PointKernel(form, points).evaluate(form.program().root(), values);
  std::copy_n(values, points.count, f.data());
}

const char* form_target_impl() {
  return hwy::TargetName(HWY_TARGET);
}

}  // namespace pileus::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pileus {

HWY_EXPORT(evaluate_points_impl);
HWY_EXPORT(form_target_impl);

void evaluate_points(const LocalForm& form, const FormPoints& points, std::span<float> f) {
  HWY_DYNAMIC_DISPATCH(evaluate_points_impl)(form, points, f);
}

const char* form_target() {
  return HWY_DYNAMIC_DISPATCH(form_target_impl)();
}

}  // namespace pileus
#endif
