#include "lib/geom/box_index.h"

#include <cmath>
#include <exception>
#include <limits>
#include <vector>

#include <embree3/rtcore.h>

#include "lib/core/error.h"
#include "lib/math/box.h"

namespace pileus {
namespace {

// The tree lives in a space of its own, where the boxes fill [-1, 1] at most: there every error of single
// precision has an absolute bound. A ray starts where it enters that cube, so its origin errs by 2^-25 per
// axis, its direction by 2^-25 per length, of which there are 2 sqrt(3) at most, and a box by 2^-25: 2^-22 in
// all. Boxes are larger by kMargin on every side; the rest is for what double precision errs in getting
// there, below 2^-22 for rays that pass kReach, and in the visitor's own test. Embree's robust mode answers
// for its arithmetic.
constexpr double kMargin = 0x1p-20;

/// Origin and place of the boxes may be this many sizes of the scene apart from the origin. Rays from farther
/// away ask for every box: rounding in double precision comes near the margin there.
constexpr double kReach = 0x1p24;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

RTCDevice device() {
  static const RTCDevice the_device = rtcNewDevice(nullptr);  // for the life of the process
  if (!the_device) throw Error(ErrorKind::failed, "Embree", "cannot be started");
  return the_device;
}

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

struct BoxIndex::Tree {
  Vec3d center{0.0, 0.0, 0.0};
  double scale = 1.0;  ///< a power of 2: p_tree = scale * (p - center)
  double reach = 0.0;  ///< sum of |o| and |center| up to which rays may use the tree
  size_t count = 0;
  RTCScene scene = nullptr;

  explicit Tree(std::span<const Box3d> boxes) : count(boxes.size()) {
    measure(boxes);
    m_boxes = boxes;
    scene = rtcNewScene(device());
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, unsigned(boxes.size()));
    rtcSetGeometryUserData(geometry, this);
    rtcSetGeometryBoundsFunction(geometry, &Tree::give_bounds, nullptr);
    rtcSetGeometryIntersectFunction(geometry, &look_into_box);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    m_boxes = {};
    if (rtcGetDeviceError(device()) != RTC_ERROR_NONE) {
      rtcReleaseScene(scene);
      throw Error(ErrorKind::failed, "Embree", fmt::format("cannot index {} boxes: no memory left", count));
    }
  }
  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;
  ~Tree() { rtcReleaseScene(scene); }

  Ray to_tree(const Ray& ray) const { return {scale * (ray.o - center), scale * ray.d}; }

 private:
  void measure(std::span<const Box3d> boxes) {
    Box3d all;
    for (const Box3d& box : boxes) all.extendBy(box);
    if (all.isEmpty()) return;
    center = 0.5 * all.min + 0.5 * all.max;
    const Vec3d half = 0.5 * all.max - 0.5 * all.min;
    const double largest = std::max({half.x, half.y, half.z});
    PILEUS_CHECK(std::isfinite(largest));
    int exponent = 0;
    std::frexp(largest, &exponent);  // largest < 2^exponent
    if (largest > 0.0) scale = std::ldexp(1.0, -exponent);
    reach = kReach * largest;
  }

  static void give_bounds(const RTCBoundsFunctionArguments* args) {
    const Tree& tree = *static_cast<const Tree*>(args->geometryUserPtr);
    const Box3d& box = tree.m_boxes[args->primID];
    if (box.isEmpty()) {  // Embree leaves out what has no valid bounds
      constexpr float kNone = std::numeric_limits<float>::infinity();
      *args->bounds_o = {kNone, kNone, kNone, 0.0f, -kNone, -kNone, -kNone, 0.0f};
      return;
    }
    const Vec3d lower = tree.scale * (box.min - tree.center) - Vec3d(kMargin);
    const Vec3d upper = tree.scale * (box.max - tree.center) + Vec3d(kMargin);
    *args->bounds_o = {float(lower.x), float(lower.y), float(lower.z), 0.0f,
                       float(upper.x), float(upper.y), float(upper.z), 0.0f};
  }

  std::span<const Box3d> m_boxes;  ///< while the tree is built
};

BoxIndex::BoxIndex(std::span<const Box3d> boxes) {
  if (boxes.empty()) return;
  if (boxes.size() >= std::numeric_limits<unsigned>::max()) {
    throw Error(ErrorKind::failed, "Embree", fmt::format("cannot index {} boxes", boxes.size()));
  }
  m_tree = std::make_shared<const Tree>(boxes);
}

void BoxIndex::search(const Ray& ray, Segment segment, Callback callback) const {
  if (!m_tree || segment.empty()) return;
  const Ray in_tree = m_tree->to_tree(ray);
  const double speed = length(in_tree.d);
  const bool is_sound =
      length(ray.o) + length(m_tree->center) <= m_tree->reach && speed > 0.0 && speed < kInfinity;
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
