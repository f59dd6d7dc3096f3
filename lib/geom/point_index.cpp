#include "lib/geom/point_index.h"

#include <cmath>

#include "lib/geom/box_tree.h"

namespace pileus {
namespace {

/// Places err by 2^-24 of their size per axis in the tree's space, boxes by less than their margin.
constexpr double kRounding = 0x1p-21;

struct Search {
  void* visitor;
  void (*call)(void* visitor, size_t box, double& radius);
  double radius;
  double scale, size;  ///< of the tree; of the point in it

  float tree_radius() const { return float(radius * scale * (1.0 + kRounding) + kRounding * (1.0 + size)); }
};

bool look_into_box(RTCPointQueryFunctionArguments* args) {
  Search& search = *static_cast<Search*>(args->userPtr);
  const double radius = search.radius;
  search.call(search.visitor, args->primID, search.radius);
  if (!(search.radius < radius)) return false;
  args->query->radius = search.tree_radius();
  return true;
}

}  // namespace

PointIndex::PointIndex(std::span<const Box3d> boxes) {
  if (!boxes.empty()) m_tree = std::make_shared<const BoxTree>(boxes, nullptr);
}

void PointIndex::search(const Vec3d& p, double radius, Callback callback) const {
  if (!m_tree) return;
  const Vec3d in_tree = m_tree->to_tree(p);
  Search search{callback.visitor, callback.call, radius, m_tree->scale, length(in_tree)};
  RTCPointQuery query{};
  query.x = float(in_tree.x), query.y = float(in_tree.y), query.z = float(in_tree.z);
  query.radius = search.tree_radius();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(m_tree->scene, &query, &context, &look_into_box, &search);
}

}  // namespace pileus
