#include "lib/geom/box_index.h"

#include <cmath>
#include <exception>
#include <limits>
#include <vector>

#include "lib/geom/box_tree.h"
#include "lib/math/box.h"

namespace pileus {
namespace {

// The tree lives in a space of its own, where the boxes fill [-1, 1] at most: there every error of single
// precision has an absolute bound. A ray starts where it enters that cube, so its origin errs by 2^-25 per
// axis, its direction by 2^-25 per length, of which there are 2 sqrt(3) at most, and a box by 2^-25: 2^-22 in
// all. Boxes are larger by kMargin on every side; the rest is for what double precision errs in getting
// there, below 2^-22 for rays that pass kReach, and in the visitor's own test. Embree's robust mode answers
// for its arithmetic.
constexpr double kMargin = BoxTree::kMargin;

/// Origin and place of the boxes may be this many sizes of the scene apart from the origin. Rays from farther
/// away ask for every box: rounding in double precision comes near the margin there.
constexpr double kReach = 0x1p24;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// One ray on its way through the tree. Embree hands the context back to the callback.
struct Search {
  RTCIntersectContext context;
  void* visitor;
  bool (*call)(void* visitor, size_t box, double& t1);
  double t1;
  double t_start;  ///< where the ray of single precision starts
  double speed;    ///< length in the tree's space for each unit of t
  std::exception_ptr failure;

  /// t1 of the tree's ray, rounded up.
  float tree_t1() const { return float((t1 - t_start) * speed * (1.0 + kMargin) + kMargin); }
};

/// The type of a callback leaves no room for exceptions.
void look_into_box(const RTCIntersectFunctionNArguments* args) {
  Search& search = *reinterpret_cast<Search*>(args->context);
  float& tree_t1 = reinterpret_cast<RTCRayHit*>(args->rayhit)->ray.tfar;
  bool goes_on = false;
  try {
    const double t1 = search.t1;
    goes_on = search.call(search.visitor, args->primID, search.t1);
    if (goes_on && search.t1 < t1) tree_t1 = std::min(tree_t1, search.tree_t1());
  } catch (...) {
    search.failure = std::current_exception();
  }
  if (!goes_on) tree_t1 = -std::numeric_limits<float>::infinity();
}

}  // namespace

struct BoxIndex::Tree : BoxTree {
  explicit Tree(std::span<const Box3d> boxes) : BoxTree(boxes, &look_into_box) {}

  /// Sum of |o| and |center| up to which rays may use the tree.
  double reach() const { return kReach * largest; }
};

BoxIndex::BoxIndex(std::span<const Box3d> boxes) {
  if (boxes.empty()) return;
  m_tree = std::make_shared<const Tree>(boxes);
}

void BoxIndex::search(const Ray& ray, Segment segment, Callback callback) const {
  if (!m_tree || segment.empty()) return;
  const Ray in_tree{m_tree->to_tree(ray.o), m_tree->scale * ray.d};
  const double speed = length(in_tree.d);
  const bool is_sound =
      length(ray.o) + length(m_tree->center) <= m_tree->reach() && speed > 0.0 && speed < kInfinity;
  if (!is_sound) {
    for (size_t i = 0; i < m_tree->count; ++i) {
      if (!callback.call(callback.visitor, i, segment.t1)) return;
    }
    return;
  }
  constexpr double kCube = 1.0 + 2.0 * kMargin;
  const Segment inside = clip_to_box(in_tree, segment, {Vec3d(-kCube), Vec3d(kCube)});
  if (inside.empty()) return;

  Search search;
  rtcInitIntersectContext(&search.context);
  search.visitor = callback.visitor;
  search.call = callback.call;
  search.t1 = segment.t1;
  search.t_start = inside.t0;
  search.speed = speed;
  const Vec3f o(in_tree.at(inside.t0)), d(in_tree.d / speed);
  RTCRayHit tree_ray{};
  tree_ray.ray.org_x = o.x, tree_ray.ray.org_y = o.y, tree_ray.ray.org_z = o.z;
  tree_ray.ray.dir_x = d.x, tree_ray.ray.dir_y = d.y, tree_ray.ray.dir_z = d.z;
  tree_ray.ray.tfar = float(inside.length() * speed * (1.0 + kMargin) + kMargin);
  tree_ray.ray.mask = ~0u;
  tree_ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(m_tree->scene, &search.context, &tree_ray);
  if (search.failure) std::rethrow_exception(search.failure);
}

}  // namespace pileus
