// What a box may hide from a sun along a ray: never too little, and no more than rounding asks for.
#include "lib/math/box_shadow.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/math/box.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Boxes, some flat, before suns, some of which stand along axes, and rays, some of which do.
class Boxes {
 public:
  Vec3d point(double reach) { return {uniform(reach), uniform(reach), uniform(reach)}; }
  Vec3d direction() {
    for (;;) {
      Vec3d v = point(1.0);
      for (int axis = 0; axis < 3; ++axis)
        if (m_random() % 4 == 0) v[axis] = 0.0;
      if (length(v) > 0.1) return normalize(v);
    }
  }
  Box3d box() {
    Box3d box(point(2.0), point(2.0));
    box.extendBy(point(2.0));
    const int flat = int(m_random() % 6);
    if (flat < 3) box.max[flat] = box.min[flat];
    for (int axis = 0; axis < 3; ++axis)
      if (box.max[axis] < box.min[axis]) std::swap(box.min[axis], box.max[axis]);
    return box;
  }

 private:
  double uniform(double reach) { return std::uniform_real_distribution<double>(-reach, reach)(m_random); }
  std::mt19937_64 m_random{11};
};

bool hides(const Box3d& box, const Vec3d& p, const Vec3d& sun) {
  const Segment inside = clip_to_box({p, sun}, {0.0, kInfinity}, box);
  return inside.t0 <= inside.t1 && (inside.t1 > 0.0 || box.intersects(p));
}

TEST(BoxShadow, holds_all_that_the_box_hides) {
  Boxes boxes;
  int hidden = 0, ends = 0;
  for (int n = 0; n < 20000; ++n) {
    const Box3d box = boxes.box();
    const Vec3d sun = boxes.direction();
    const Ray ray{boxes.point(4.0), boxes.direction()};
    const Segment whole{0.0, 10.0}, told = shadow_of_box(ray, whole, sun, box);
    for (double t = 0.05; t < whole.t1; t += 0.31) {
      if (!hides(box, ray.at(t), sun)) continue;
      ++hidden;
      ASSERT_TRUE(t >= told.t0 && t <= told.t1) << "box " << n << ", t " << t;
    }
    // A little inside its ends, a box that is a little larger hides the sun: no more than that is told.
    if (!(told.length() > 1e-6)) continue;
    ++ends;
    const Box3d grown(box.min - Vec3d(1e-9), box.max + Vec3d(1e-9));
    for (const double t : {told.t0 + 1e-9, told.t1 - 1e-9})
      ASSERT_TRUE(hides(grown, ray.at(t), sun)) << "box " << n << ", t " << t;
  }
  EXPECT_GT(hidden, 4000);
  EXPECT_GT(ends, 1000);
}

TEST(BoxShadow, of_a_box_without_end_is_all_and_of_none_is_none) {
  Box3d everything;
  everything.makeInfinite();
  const Ray ray{Vec3d(0.0), normalize(Vec3d(1.0, 2.0, 3.0))};
  const Segment all = shadow_of_box(ray, {1.0, 5.0}, {0.0, 1.0, 0.0}, everything);
  EXPECT_EQ(all.t0, 1.0);
  EXPECT_EQ(all.t1, 5.0);
  EXPECT_TRUE(shadow_of_box(ray, {1.0, 5.0}, {0.0, 1.0, 0.0}, Box3d()).empty());
}

}  // namespace
}  // namespace pileus
