#include "lib/geom/box_tree.h"

#include <algorithm>
#include <cmath>

#include "lib/core/error.h"

namespace pileus {
namespace {

RTCDevice device() {
  static const RTCDevice the_device = rtcNewDevice(nullptr);  // for the life of the process
  if (!the_device) throw Error(ErrorKind::failed, "Embree", "cannot be started");
  return the_device;
}

}  // namespace

BoxTree::BoxTree(std::span<const Box3d> boxes, RTCIntersectFunctionN met) : count(boxes.size()) {
  if (count >= std::numeric_limits<unsigned>::max())
    throw Error(ErrorKind::failed, "Embree", fmt::format("cannot index {} boxes", count));
  measure(boxes);
  m_boxes = boxes;
  scene = rtcNewScene(device());
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, unsigned(boxes.size()));
  rtcSetGeometryUserData(geometry, this);
  rtcSetGeometryBoundsFunction(geometry, &BoxTree::give_bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, met);
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

BoxTree::~BoxTree() {
  rtcReleaseScene(scene);
}

void BoxTree::measure(std::span<const Box3d> boxes) {
  Box3d all;
  for (const Box3d& box : boxes) all.extendBy(box);
  if (all.isEmpty()) return;
  center = 0.5 * all.min + 0.5 * all.max;
  const Vec3d half = 0.5 * all.max - 0.5 * all.min;
  largest = std::max({half.x, half.y, half.z});
  PILEUS_CHECK(std::isfinite(largest));
  int exponent = 0;
  std::frexp(largest, &exponent);  // largest < 2^exponent
  if (largest > 0.0) scale = std::ldexp(1.0, -exponent);
}

void BoxTree::give_bounds(const RTCBoundsFunctionArguments* args) {
  const BoxTree& tree = *static_cast<const BoxTree*>(args->geometryUserPtr);
  const Box3d& box = tree.m_boxes[args->primID];
  if (box.isEmpty()) {  // Embree leaves out what has no valid bounds
    constexpr float kNone = std::numeric_limits<float>::infinity();
    *args->bounds_o = {kNone, kNone, kNone, 0.0f, -kNone, -kNone, -kNone, 0.0f};
    return;
  }
  const Vec3d lower = tree.to_tree(box.min) - Vec3d(kMargin), upper = tree.to_tree(box.max) + Vec3d(kMargin);
  *args->bounds_o = {float(lower.x), float(lower.y), float(lower.z), 0.0f,
                     float(upper.x), float(upper.y), float(upper.z), 0.0f};
}

}  // namespace pileus
