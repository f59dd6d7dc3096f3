// What suns light of rays past solids: by the edges that shapes tell, by search, and by looking everywhere.
#include "integrators/solid_shadows.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "lib/core/param_table.h"
#include "lib/math/box.h"
#include "lib/math/roots.h"
#include "lib/volume/density_field.h"
#include "tests/fixtures/traced_scene.h"

namespace pileus {
namespace {

/// A sphere that may keep its shadow's edges to itself.
struct Ball final : Shape {
  Vec3d center;
  double radius;
  bool tells;

  Ball(const Vec3d& c, double r, bool is_telling) : center(c), radius(r), tells(is_telling) {}
  void describe_form(ParamTable&) override {}
  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const override {
    const auto t = sphere_hits(ray.o - center, ray.d, radius).first_in(segment.t0, segment.t1);
    if (!t) return std::nullopt;
    return SurfaceHit{*t, normalize(ray.at(*t) - center), 0.0};
  }
  bool knows_shadow_edges() const override { return tells; }
  void append_shadow_edges(const Ray& ray, const Light& light, std::vector<double>& t) const override {
    const Vec3d wi = light.at(ray.o).wi, f = ray.o - center;
    const Vec3d across = f - dot(f, wi) * wi, d = ray.d - dot(ray.d, wi) * wi;
    const auto edges = quadratic_roots(d.length2(), 2.0 * dot(across, d), across.length2() - radius * radius);
    t.insert(t.end(), edges.begin(), edges.end());
  }
  Box3d bounds() const override { return {center - Vec3d(radius), center + Vec3d(radius)}; }
};

struct Sun final : Light {
  Vec3d wi;
  explicit Sun(const Vec3d& towards) : wi(normalize(towards)) {}
  void describe(ParamTable&) override {}
  Illumination at(const Vec3d&) const override {
    return {wi, std::numeric_limits<double>::infinity(), Rgb(1.0)};
  }
  bool is_directional() const override { return true; }
};

/// A box of something, with voxels of 1/32 m.
struct Box final : DensityField {
  Box3d bounds() const override { return {Vec3d(-2.0), Vec3d(2.0)}; }
  double max_density() const override { return 1.0; }
  double feature_size() const override { return 1.0 / 32.0; }
  bool has_bricks() const override { return true; }
  void append_pieces(const Ray&, Segment, std::vector<DensityPiece>&, FieldCounters&) const override {}
  double column(const Ray&, Segment, double, FieldCounters&) const override { return 0.0; }
  void sample(const Ray&, double, double, std::span<double>, FieldCounters&) const override {}
};

/// Haze that is denser below, without voxels.
struct Haze final : DensityField {
  Box3d bounds() const override { return {Vec3d(-100.0), Vec3d(100.0)}; }
  double max_density() const override { return 1.0; }
  double feature_size() const override { return 50.0; }  // no voxel: nothing to search by
  void append_pieces(const Ray& ray, Segment segment, std::vector<DensityPiece>& pieces,
                     FieldCounters&) const override {
    const Segment inside = clip_to_box(ray, segment, bounds());
    const double rate = -ray.d.y / 50.0;
    if (!inside.empty())
      pieces.push_back({inside.t0, inside.t1, {std::exp(-(ray.at(inside.t0).y + 100.0) / 50.0)}, rate});
  }
  double column(const Ray&, Segment, double, FieldCounters&) const override { return 0.0; }
  void sample(const Ray&, double, double, std::span<double>, FieldCounters&) const override {}
};

World world_of(bool tells) {
  World world;
  WorldMedium& medium = world.media.emplace_back();
  medium.density = std::make_shared<Box>();
  medium.extinction = 1.0;
  for (const Vec3d& wi : {Vec3d(0.3, 1.0, 0.2), Vec3d(-1.0, 0.2, 0.1)})
    world.lights.push_back(std::make_shared<Sun>(wi));
  world.shapes.push_back(std::make_shared<Ball>(Vec3d(0.5, 3.0, 0.4), 0.6, tells));
  world.shapes.push_back(std::make_shared<Ball>(Vec3d(-1.0, 0.3, 0.0), 0.4, tells));
  world.shapes.push_back(std::make_shared<Ball>(Vec3d(-0.8, 0.4, 0.3), 0.3, tells));
  return world;
}

/// Rays end where they meet a solid.
std::vector<MarchRay> random_packet(const World& world, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto point = [&] { return Vec3d(normal(random), normal(random), normal(random)); };
  const Vec3d o = 5.0 * normalize(point()), target = point();
  std::vector<MarchRay> packet(kPacketRays);
  for (MarchRay& job : packet) {
    job.ray = {o, normalize(target + 0.02 * point() - o)};
    job.segment = {0.0, std::numeric_limits<double>::infinity()};
    if (const auto hit = nearest_surface(world, job.ray, job.segment)) job.segment.t1 = hit->t;
  }
  return packet;
}

bool contains(const std::vector<Segment>& stretches, double t) {
  return std::any_of(stretches.begin(), stretches.end(),
                     [&](const Segment& s) { return t >= s.t0 && t < s.t1; });
}

/// Every point inside the medium is lit where nothing stands before the sun; closer than `margin` to an edge
/// both are right.
void expect_right(const World& world, const MarchRay& job, double margin) {
  const Segment inside = clip_to_box(job.ray, job.segment, world.media[0].density->bounds());
  for (size_t light = 0; light < world.lights.size(); ++light) {
    const auto is_lit = [&](double t) {
      const Ray shadow{job.ray.at(t), world.lights[light]->at(Vec3d(0.0)).wi};
      return !is_occluded(world, shadow, {0.0, std::numeric_limits<double>::infinity()});
    };
    for (double t = inside.t0 + 0.003; t < inside.t1; t += 0.031) {
      const bool lit = is_lit(t), told = !job.lit || contains(job.lit[light], t);
      if (told == lit) continue;
      ASSERT_TRUE(is_lit(t - margin) != lit || is_lit(t + margin) != lit) << "t " << t << ", light " << light;
    }
  }
}

TEST(SolidShadows, are_where_the_sun_is_hidden) {
  for (const bool tells : {true, false}) {
    const World world = world_of(tells);
    const SolidShadows shadows(world);
    ASSERT_TRUE(shadows.any());
    std::mt19937 random(7);
    size_t shaded = 0, edges = 0;
    for (int n = 0; n < 100; ++n) {
      std::vector<MarchRay> packet = random_packet(world, random);
      std::vector<std::vector<Segment>> lit(packet.size() * world.lights.size());
      const uint64_t shadow_rays = shadows.find(packet, lit);
      EXPECT_TRUE(shadow_rays > 0 || packet[0].lit == nullptr);
      shaded += packet[0].lit != nullptr;
      for (const auto& stretches : lit) edges += stretches.size() > 1;
      // A search may miss what is shaded for less than a step, which is about a voxel.
      for (const MarchRay& job : packet) expect_right(world, job, tells ? 1e-9 : 1.0 / 24.0);
    }
    EXPECT_GT(shaded, 20u);
    EXPECT_GT(edges, 100u);
  }
}

/// Optical depth of a stretch of haze.
double depth_of(const WorldMedium& haze, const Ray& ray, Segment stretch) {
  std::vector<DensityPiece> pieces;
  FieldCounters counters;
  haze.density->append_pieces(ray, stretch, pieces, counters);
  double depth = 0.0;
  for (const DensityPiece& piece : pieces) depth += haze.extinction * column_to(piece, piece.t1);
  return depth;
}

/// Stretches of one that are not of the other, either way.
Segments difference(const Segments& a, const Segments& b) {
  return unite(subtract(a, b), subtract(b, a));
}

/// In haze so thin that a solid's shadow hardly shows, what a search leaves out or misplaces is less than
/// that, and it looks the fewer times the thinner the haze.
TEST(SolidShadows, search_no_closer_than_haze_shows) {
  constexpr double kLeast = 0.03, kNegligible = kLeast / 600.0;
  uint64_t last_rays = std::numeric_limits<uint64_t>::max();
  for (const double extinction : {1e-2, 1e-3, 1e-4, 1e-5}) {
    World known = world_of(true), searched = world_of(false);
    for (World* world : {&known, &searched}) {
      world->media[0].density = std::make_shared<Haze>();
      world->media[0].extinction = extinction;
    }
    const SolidShadows by_edges(known, kLeast), by_search(searched, kLeast);
    std::mt19937 random(8);
    uint64_t shadow_rays = 0;
    double worst = 0.0;
    for (int n = 0; n < 60; ++n) {
      std::vector<MarchRay> packet = random_packet(known, random), same = packet;
      std::vector<std::vector<Segment>> expected(packet.size() * 2), found(packet.size() * 2);
      by_edges.find(packet, expected);
      shadow_rays += by_search.find(same, found);
      for (size_t i = 0; i < expected.size(); ++i) {
        double depth = 0.0;
        for (const Segment& wrong : difference(expected[i], found[i]))
          depth += depth_of(known.media[0], packet[i / 2].ray, wrong);
        worst = std::max(worst, depth);
      }
    }
    EXPECT_LT(shadow_rays, last_rays) << extinction;
    last_rays = shadow_rays;
    // Three solids whose shadows each may have been missed at both ends, or left out together.
    EXPECT_LT(worst, 4.0 * kNegligible) << extinction;
  }
  EXPECT_EQ(last_rays, 0u) << "nothing is worth a look";
}

/// Many solids, none of whose shadows matters, are not left out together.
TEST(SolidShadows, many_that_are_negligible_are_not) {
  constexpr double kLeast = 0.03, kNegligible = kLeast / 600.0;
  World world = world_of(false);
  world.media[0].density = std::make_shared<Haze>();
  world.media[0].extinction = 3e-3;
  world.lights.resize(1);
  world.lights[0] = std::make_shared<Sun>(Vec3d(0.0, 1.0, 0.0));
  world.shapes.clear();
  for (int n = 0; n < 40; ++n)
    world.shapes.push_back(std::make_shared<Ball>(Vec3d(2.0 * n - 40.0, -20.0, 0.0), 0.05, false));
  std::vector<MarchRay> packet(1);
  packet[0].ray = {Vec3d(-60.0, -40.0, 0.0), Vec3d(1.0, 0.0, 0.0)};
  packet[0].segment = {0.0, 120.0};
  std::vector<std::vector<Segment>> lit(1);
  EXPECT_GT(SolidShadows(world, kLeast).find(packet, lit), 0u);
  const double lit_depth = [&] {
    double depth = 0.0;
    for (const Segment& stretch : lit[0]) depth += depth_of(world.media[0], packet[0].ray, stretch);
    return depth;
  }();
  const double whole = depth_of(world.media[0], packet[0].ray, packet[0].segment);
  const double shaded = 40 * 0.1 / 120.0 * whole;  // the haze is the same at one height
  EXPECT_GT(shaded, 10.0 * kNegligible);
  EXPECT_NEAR(whole - lit_depth, shaded, 2.0 * kNegligible);
}

TEST(SolidShadows, none_where_solids_are_behind_the_media) {
  World world = world_of(true);
  world.shapes = {std::make_shared<Ball>(Vec3d(0.0, -5.0, 0.0), 0.5, true)};
  EXPECT_FALSE(SolidShadows(world).any());
}

}  // namespace
}  // namespace pileus
