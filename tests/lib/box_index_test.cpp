// The index against asking every box: what it leaves out must be out of the ray's reach in double precision.
#include "lib/geom/box_index.h"

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "lib/math/box.h"

namespace pileus {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

/// Boxes and rays at a place, of a size, as nasty as scenes may be.
class BoxIndexTest : public testing::Test {
 protected:
  std::mt19937 m_random{5};

  double uniform(double a = -1.0, double b = 1.0) {
    return std::uniform_real_distribution<double>(a, b)(m_random);
  }
  bool chance(double p) { return uniform(0.0, 1.0) < p; }
  Vec3d vector() { return {uniform(), uniform(), uniform()}; }
  Vec3d axis() {
    Vec3d d(0.0);
    d[int(uniform(0.0, 3.0))] = chance(0.5) ? 1.0 : -1.0;
    return d;
  }

  /// Within [-1, 1]; some flat, some lines and points, some empty.
  std::vector<Box3d> boxes(size_t count) {
    std::vector<Box3d> result;
    for (size_t i = 0; i < count; ++i) {
      const Vec3d center = vector();
      Vec3d half = std::exp2(uniform(-12.0, -1.0)) * Vec3d(uniform(0, 1), uniform(0, 1), uniform(0, 1));
      for (int axis = 0; axis < 3; ++axis) {
        if (chance(0.1)) half[axis] = 0.0;
      }
      result.push_back(chance(0.02) ? Box3d() : Box3d(center - half, center + half));
    }
    return result;
  }

  /// Aimed at a box: its inside, its faces, its edges or its corners.
  Ray ray(const std::vector<Box3d>& all) {
    const Box3d& box = all[size_t(uniform(0.0, double(all.size()) * 0.999))];
    if (box.isEmpty()) return {3.0 * vector(), normalize(vector())};
    Vec3d target;
    for (int k = 0; k < 3; ++k) {
      const double share = uniform(-0.5, 1.5);  // a third each: lower side, within, upper side
      target[k] = box.min[k] + std::clamp(share, 0.0, 1.0) * (box.max[k] - box.min[k]);
    }
    const double away = std::exp2(uniform(-4.0, 12.0));
    Vec3d d = chance(0.3) ? axis() : normalize(vector());
    if (chance(0.1)) d = normalize(axis() + std::exp2(uniform(-60.0, -10.0)) * vector());
    if (chance(0.1)) return {target, d};  // starts on it or inside
    return {target - away * d, d};
  }
};

TEST_F(BoxIndexTest, loses_no_box_that_a_ray_meets) {
  size_t met = 0, asked = 0, rays = 0;
  for (const double size : {1.0, 1e-3, 1e7, 1e-30, 1e30}) {
    for (const double place : {0.0, 1.0, 1e4, 1.5e5, 1e7}) {
      for (const size_t count : {1, 3, 20, 400}) {
        std::vector<Box3d> all = boxes(count);
        const Vec3d offset = place * size * Vec3d(1.0, -0.7, 0.3);
        std::vector<Box3d> placed = all;
        for (Box3d& box : placed) {
          if (!box.isEmpty()) box = {size * box.min + offset, size * box.max + offset};
        }
        const BoxIndex index(placed);
        for (int n = 0; n < 300; ++n) {
          const Ray r = ray(all);
          const Ray placed_ray{size * r.o + offset, chance(0.2) ? uniform(0.1, 10.0) * r.d : r.d};
          Segment segment{0.0, kInf};
          if (chance(0.2)) segment = {size * uniform(0.0, 3.0), size * uniform(3.0, 5000.0)};
          std::vector<char> was_asked(count);
          index.visit(placed_ray, segment, [&](size_t box, double&) {
            asked += place < 1e7;  // there, all are asked
            was_asked[box] = 1;
            return true;
          });
          ++rays;
          for (size_t i = 0; i < count; ++i) {
            if (placed[i].isEmpty() || clip_to_box(placed_ray, segment, placed[i]).empty()) continue;
            ++met;
            ASSERT_TRUE(was_asked[i]) << "size " << size << ", place " << place << ", box " << placed[i].min
                                      << placed[i].max << ", ray " << placed_ray.o << placed_ray.d;
          }
        }
      }
    }
  }
  EXPECT_GT(met, rays / 2);
  EXPECT_LT(asked, 10 * met) << "it asks far too many";
}

TEST_F(BoxIndexTest, goes_on_only_as_far_as_it_is_told) {
  std::vector<Box3d> row;
  for (int i = 0; i < 100; ++i) row.push_back({Vec3d(i, -0.1, -0.1), Vec3d(i + 0.5, 0.1, 0.1)});
  const BoxIndex index(row);
  std::vector<size_t> asked;
  index.visit({{-1, 0, 0}, {1, 0, 0}}, {0.0, kInf}, [&](size_t box, double& t1) {
    asked.push_back(box);
    t1 = std::min(t1, 1.0 + double(box));
    return true;
  });
  EXPECT_LT(asked.size(), 20u) << "boxes behind the nearest are not asked";
  EXPECT_NE(std::find(asked.begin(), asked.end(), 0u), asked.end());
  asked.clear();
  index.visit({{-1, 0, 0}, {1, 0, 0}}, {0.0, kInf}, [&](size_t box, double&) {
    asked.push_back(box);
    return false;
  });
  EXPECT_EQ(asked.size(), 1u);
}

TEST_F(BoxIndexTest, asks_everybody_where_a_ray_makes_no_sense) {
  const std::vector<Box3d> all = boxes(50);
  const BoxIndex index(all);
  const auto asked = [&](const Ray& ray, Segment segment) {
    size_t count = 0;
    index.visit(ray, segment, [&](size_t, double&) { return ++count, true; });
    return count;
  };
  for (const double bad : {kInf, -kInf, std::nan(""), 1e200}) {
    EXPECT_EQ(asked({{0, bad, 0}, {1, 0, 0}}, {0.0, kInf}), 50u);
  }
  for (const double bad : {kInf, -kInf, std::nan("")}) {
    EXPECT_EQ(asked({{0, 0, 0}, {bad, 0, 1}}, {0.0, kInf}), 50u);
  }
  EXPECT_EQ(asked({{0, 0, 0}, {0, 0, 0}}, {0.0, kInf}), 50u);
  EXPECT_EQ(asked({{0, 0, 0}, {1, 0, 0}}, {1.0, 1.0}), 0u);
  EXPECT_EQ(asked({{0, 0, 0}, {1, 0, 0}}, {std::nan(""), 1.0}), 0u);
  BoxIndex().visit({{0, 0, 0}, {1, 0, 0}}, {0.0, kInf}, [](size_t, double&) -> bool {
    ADD_FAILURE();
    return true;
  });
}

TEST_F(BoxIndexTest, lets_exceptions_through) {
  const std::vector<Box3d> all{{Vec3d(-1.0), Vec3d(1.0)}, {Vec3d(-1.0), Vec3d(2.0)}};
  const BoxIndex index(all);
  int calls = 0;
  EXPECT_THROW(index.visit({{-5, 0, 0}, {1, 0, 0}}, {0.0, kInf},
                           [&](size_t, double&) -> bool {
                             ++calls;
                             throw std::runtime_error("no");
                           }),
               std::runtime_error);
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace pileus
