// Rays and free forms: no crossing is missed whose depth is beyond rounding, by proof in higher precision.
#include "lib/freeform/form_tracer.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iomanip>
#include <optional>
#include <sstream>

#include <gtest/gtest.h>

#include "lib/freeform/shapes.h"
#include "lib/math/box.h"
#include "tests/fixtures/random_forms.h"
#include "tests/reference/form_oracle.h"

namespace pileus {
namespace {

constexpr double kMargin = 0x1p-45;  ///< docs/freeform.md, What the bounds promise

int hunt(int rays) {
  const char* factor = std::getenv("PILEUS_HUNT");
  return factor ? rays * std::atoi(factor) : rays;
}

/// Plain forms and rays that try to slip through.
class HostileRays {
 public:
  explicit HostileRays(uint64_t seed) : m_forms(seed) {}

  RandomForms& forms() { return m_forms; }

  FreeForm plain_form() {
    FreeForm form = perturbed(m_forms.quadric());
    if (m_forms.chance(0.2)) form = morphed(form, perturbed(m_forms.quadric()), m_forms.uniform(0, 1));
    if (m_forms.chance(0.3)) form = placed(form, m_forms.placement());
    return form;
  }

  /// Any ray, or one that almost touches the solid; from nearby, or from 100 km away.
  Ray ray(const FreeForm& form) {
    const double distance = m_forms.chance(0.3) ? 1e5 : m_forms.uniform(0, 12);
    Vec3d d = normalize(m_forms.direction());
    Vec3d p = m_forms.point(3);
    if (m_forms.chance(0.6)) {
      const Ray probe{p - 6.0 * d, d};
      const Segments found = inside(form, probe, {0, 12});
      if (!found.empty()) {
        p = probe.at(found[size_t(m_forms.pick(int(found.size())))].t0);
        const Vec3d gradient = form.gradient(p);
        const double steepness = length(gradient);
        const Vec3d across = cross(gradient, m_forms.direction());
        if (std::isfinite(steepness) && steepness > 1e-100 && length(across) > 1e-100) {
          d = normalize(across);
          const double off = m_forms.chance(0.2) ? 0.0 : std::pow(10.0, m_forms.uniform(-17, -1));
          p += (m_forms.chance(0.5) ? off : -off) * (gradient / steepness);
        }
      }
    }
    return {p - distance * d, d};
  }

  Segment segment(const Ray& ray) {
    const double far = length(ray.o) + 15;
    return {m_forms.chance(0.2) ? m_forms.uniform(0, far) : std::max(0.0, length(ray.o) - 15), far};
  }

 private:
  FreeForm perturbed(const FreeForm& base) {
    std::vector<Perturbation> bumps;
    const int count = m_forms.pick(5);
    for (int n = 0; n < count; ++n) {
      const double factor = m_forms.chance(0.1) ? std::pow(10.0, m_forms.uniform(-12, 3)) : 1.5;
      bumps.push_back({m_forms.quadric(), factor * m_forms.uniform(-1, 1)});
    }
    return pileus::perturbed(base, bumps);
  }

  RandomForms m_forms;
};

std::string described(const Ray& ray, const Segment& segment, const Segments& found) {
  std::ostringstream text;
  text << std::setprecision(17) << "ray " << ray.o << " + t " << ray.d << ", t in " << segment.t0 << ".."
       << segment.t1 << ", inside:";
  for (const Segment& part : found) text << " [" << part.t0 << ", " << part.t1 << "]";
  return text.str();
}

/// Every stretch told is inside, every gap outside, but for the margin and for the last digit of t.
template <class T>
void expect_true(const FreeForm& form, const Ray& ray, const Segment& segment, const Segments& found) {
  const Segment reach = clip_to_box(ray, segment, form.bounds());
  const reference::FormOracle<T> oracle(form.program(), ray, segment, reach, kMargin);
  const auto check = [&](Segment part, int sign) {
    const double last_digit = 0x1p-52 * std::max(std::fabs(part.t0), std::fabs(part.t1));
    if (part.t0 > segment.t0) part.t0 += last_digit;
    if (part.t1 < segment.t1) part.t1 -= last_digit;
    if (part.empty()) return;
    EXPECT_TRUE(oracle.holds(part, sign))
        << (sign > 0 ? "stretch " : "gap ") << part.t0 << ".." << part.t1 << "\n"
        << described(ray, segment, found);
  };
  double end = segment.t0;
  for (const Segment& part : found) {
    ASSERT_LT(part.t0, part.t1);
    ASSERT_LE(end, part.t0);
    check({end, part.t0}, -1);
    check(part, 1);
    end = part.t1;
  }
  ASSERT_LE(end, segment.t1);
  check({end, segment.t1}, -1);
}

template <class T>
void hunt_for_misses(uint64_t seed, int rays) {
  HostileRays hostile(seed);
  constexpr int kRaysPerForm = 50;
  int64_t stretches = 0;
  for (int n = 0; n < rays / kRaysPerForm; ++n) {
    const FreeForm form = hostile.plain_form();
    const FormTracer tracer(form);
    for (int k = 0; k < kRaysPerForm; ++k) {
      const Ray ray = hostile.ray(form);
      const Segment segment = hostile.segment(ray);
      const Segments found = tracer.inside(ray, segment);
      stretches += int64_t(found.size());
      expect_true<T>(form, ray, segment, found);
      if (testing::Test::HasFailure()) {
        ADD_FAILURE() << "form " << n << ", ray " << k << ", seed " << seed;
        return;
      }
    }
  }
  EXPECT_GT(stretches, rays / 4);
}

TEST(FormTracer, misses_nothing_beyond_rounding) {
  hunt_for_misses<long double>(81, hunt(100'000));
}

TEST(FormTracer, misses_nothing_in_quadruple_precision) {
  hunt_for_misses<reference::Quad>(82, hunt(2'000));
}

/// A ray that a longer hunt had found, where a stretch of one sign begins with a value of 0 within rounding:
/// that zero was once taken for the crossing at the stretch's other end.
TEST(FormTracer, takes_no_zero_for_the_next) {
  const Frame frame(Vec3d(-0x1.5f15965a4dfdcp+0, 0x1.4ab7b8fff62b8p+0, -0x1.fa7a8ed78e4b3p+0),
                    std::array{Vec3d(-0x0p+0, 0x1.4507edcc4939fp+1, 0x1.601e179384c75p+0),
                               Vec3d(0x1.7086801f167ddp+1, 0x1.b75196c6a0c59p-4, -0x1.958631ee67439p-3),
                               Vec3d(-0x1.13d54071a60fp+5, 0x1.a3e8d185978bbp+7, -0x1.839ba570299fcp+8)});
  const FreeForm hyperboloid = Quadric(frame, {.a33 = 1.0});
  const Ray ray{Vec3d(0x1.5fae8fdc83a67p+0, 0x1.35b85f79e08adp+1, -0x1.c018418cb339p+1),
                Vec3d(0x1.c10919855883ap-8, -0x1.7f3472e7e1e2ep-4, 0x1.fdbe082cbde16p-1)};
  const Segment segment{0x0p+0, 0x1.378ca059a55d6p+4};
  expect_true<reference::Quad>(hyperboloid, ray, segment, inside(hyperboloid, ray, segment));
}

TEST(FormTracer, first_crossings_are_ends_of_stretches) {
  RandomForms forms(83);
  int crossings = 0;
  for (int n = 0; n < hunt(300); ++n) {
    const FreeForm form = forms.form(forms.pick(3));
    const FormTracer tracer(form);
    const Ray ray{forms.point(6), normalize(forms.direction())};
    const Segment segment{forms.uniform(0, 4), 12};
    std::optional<double> expected;
    for (const Segment& part : tracer.inside(ray, segment)) {
      for (const double t : {part.t1, part.t0}) {
        if (segment.t0 < t && t < segment.t1 && (!expected || t < *expected)) expected = t;
      }
    }
    ASSERT_EQ(tracer.first_crossing(ray, segment), expected) << "form " << n;
    crossings += expected.has_value();
  }
  EXPECT_GT(crossings, 50);
}

/// Rays side by side, as from the pixels of a tile or towards a sun from neighbouring points.
struct Bundle {
  std::vector<Ray> rays;
  std::vector<Segment> segments;

  void add(const Ray& ray, const Segment& segment) {
    rays.push_back(ray);
    segments.push_back(segment);
  }
};

/// Around a ray that tries to slip through: nearly the same, or fanned out, or parallel.
Bundle bundle(HostileRays& hostile, const FreeForm& form, int count) {
  Bundle result;
  const Ray middle = hostile.ray(form);
  const Segment segment = hostile.segment(middle);
  const double spread = std::pow(10.0, hostile.forms().uniform(-12, -1));
  const int kind = hostile.forms().pick(3);
  result.add(middle, segment);
  for (int n = 1; n < count; ++n) {
    Ray ray = middle;
    if (kind != 0) ray.o += hostile.forms().point(spread);
    if (kind != 1) ray.d = normalize(ray.d + hostile.forms().point(spread / (1 + length(ray.o))));
    result.add(ray, segment);
  }
  return result;
}

/// The way to a crossing, or all of the segment where there is none, is on one side; at a crossing the form
/// may be 0.
template <class T>
void expect_true_crossing(const FreeForm& form, const Ray& ray, const Segment& segment, double t) {
  const Segment reach = clip_to_box(ray, segment, form.bounds());
  const reference::FormOracle<T> oracle(form.program(), ray, segment, reach, kMargin);
  const auto holds = [&](Segment part) { return oracle.holds(part, -1) || oracle.holds(part, 1); };
  const std::string what = described(ray, segment, {{segment.t0, t}});
  if (!std::isfinite(t)) {
    EXPECT_TRUE(holds(segment)) << "none; " << what;
    return;
  }
  const double last_digit = 0x1p-52 * std::fabs(t);
  ASSERT_TRUE(segment.t0 < t && t < segment.t1) << what;
  if (t - last_digit > segment.t0) {
    EXPECT_TRUE(holds({segment.t0, t - last_digit})) << "before; " << what;
  }
  const Segment here{t - last_digit, t + last_digit};
  EXPECT_TRUE(!oracle.holds(here, 1) || !oracle.holds(here, -1) ||
              (oracle.holds({t, t}, 1) && oracle.holds({t, t}, -1)))
      << "at; " << what;
}

TEST(FormTracer, rays_together_miss_nothing_beyond_rounding) {
  HostileRays hostile(85);
  int64_t crossings = 0, rays = 0;
  for (int n = 0; n < hunt(600); ++n) {
    const FreeForm form = hostile.plain_form();
    const FormTracer tracer(form);
    for (int k = 0; k < 3; ++k) {
      const Bundle b = bundle(hostile, form, 16 + hostile.forms().pick(60));
      std::vector<double> t(b.rays.size());
      tracer.first_crossings(b.rays, b.segments, t);
      for (size_t i = 0; i < t.size(); ++i) {
        expect_true_crossing<long double>(form, b.rays[i], b.segments[i], t[i]);
        crossings += std::isfinite(t[i]);
        ++rays;
      }
      ASSERT_FALSE(testing::Test::HasFailure()) << "form " << n << ", bundle " << k;
    }
  }
  EXPECT_GT(crossings, rays / 4);
}

/// Whatever stands beside a ray, and whatever the beam of all leaves out: the same bits as alone.
TEST(FormTracer, rays_together_are_as_alone) {
  HostileRays hostile(86);
  for (int n = 0; n < hunt(400); ++n) {
    const FreeForm form = n % 4 == 0 ? hostile.forms().form(2) : hostile.plain_form();
    const FormTracer tracer(form);
    const Bundle b = bundle(hostile, hostile.plain_form(), 1 + hostile.forms().pick(130));
    std::vector<double> t(b.rays.size());
    std::vector<char> met(b.rays.size(), 0);
    tracer.first_crossings(b.rays, b.segments, t);
    tracer.find_met(b.rays, b.segments, met);
    for (size_t i = 0; i < t.size(); ++i) {
      double alone = 0.0;
      char alone_met = 0;
      tracer.first_crossings({&b.rays[i], 1}, {&b.segments[i], 1}, {&alone, 1});
      tracer.find_met({&b.rays[i], 1}, {&b.segments[i], 1}, {&alone_met, 1});
      ASSERT_EQ(t[i], alone) << "form " << n << ", ray " << i;
      ASSERT_EQ(met[i], alone_met) << "form " << n << ", ray " << i;
    }
  }
}

/// One by one is the slow twin. Where both see a crossing it is the same place, but for what rounding does to
/// a function that is nearly 0.
TEST(FormTracer, rays_together_agree_with_one_by_one) {
  RandomForms forms(87);
  int crossings = 0;
  for (int n = 0; n < hunt(300); ++n) {
    std::vector<Perturbation> bumps;
    for (int k = forms.pick(6); k > 0; --k) {
      bumps.push_back({sphere(forms.point(1.2), forms.uniform(0.3, 0.8)), forms.uniform(-1, 1)});
    }
    FreeForm form = perturbed(sphere({0, 0, 0}, 1), bumps);
    if (n % 3 == 1) form = joined(Join::unite, form, ellipsoid(forms.point(1), {0.4, 1.5, 0.5}));
    if (n % 3 == 2) form = joined(Join::subtract, form, sphere(forms.point(1), 0.7));
    const FormTracer tracer(form);
    Bundle b;
    const Vec3d eye = 4.0 * normalize(forms.direction());
    for (int i = 0; i < 64; ++i) {
      const Vec3d o = n % 5 == 0 ? forms.point(1.5) : eye;
      b.add({o, normalize(forms.point(1.3) - o)}, {0, 20});
    }
    std::vector<double> t(b.rays.size());
    std::vector<char> met(b.rays.size(), 0);
    tracer.first_crossings(b.rays, b.segments, t);
    tracer.find_met(b.rays, b.segments, met);
    for (size_t i = 0; i < t.size(); ++i) {
      const std::optional<double> expected = tracer.first_crossing(b.rays[i], b.segments[i]);
      ASSERT_EQ(std::isfinite(t[i]), expected.has_value()) << "form " << n << ", ray " << i;
      ASSERT_EQ(met[i] != 0, expected.has_value()) << "form " << n << ", ray " << i;
      if (!expected) continue;
      const double steepness = std::fabs(dot(form.gradient(b.rays[i].at(*expected)), b.rays[i].d));
      if (steepness > 1e-3) {
        ASSERT_NEAR(t[i], *expected, 1e-11) << "form " << n << ", ray " << i;
      }
      ++crossings;
    }
  }
  EXPECT_GT(crossings, 3000);
}

/// From anywhere to anywhere, as to a lamp inside: what is buried in another part of a union shades nothing.
TEST(FormTracer, rays_that_end_inside_a_union_meet_its_surface_alone) {
  RandomForms forms(89);
  int met_none = 0, met_some = 0;
  for (int n = 0; n < hunt(200); ++n) {
    FreeForm form = sphere(forms.point(0.5), forms.uniform(0.2, 0.6));
    for (int k = 1 + forms.pick(3); k > 0; --k)
      form = joined(Join::unite, form, ellipsoid(forms.point(0.6), {0.9, 1.2, 0.8}));
    if (n % 3 == 0) form = joined(Join::subtract, form, sphere(forms.point(0.8), 0.2));
    const FormTracer tracer(form);
    Bundle b;
    const Vec3d lamp = forms.point(0.7);
    for (int i = 0; i < 64; ++i) {
      const Vec3d o = forms.point(i % 2 == 0 ? 0.7 : 2.0);
      b.add({o, normalize(lamp - o)}, {0, length(lamp - o)});
    }
    std::vector<char> met(b.rays.size(), 0);
    tracer.find_met(b.rays, b.segments, met);
    for (size_t i = 0; i < met.size(); ++i) {
      const bool expected = tracer.first_crossing(b.rays[i], b.segments[i]).has_value();
      ASSERT_EQ(met[i] != 0, expected) << "form " << n << ", ray " << i;
      ++(expected ? met_some : met_none);
    }
  }
  EXPECT_GT(met_none, 2000);
  EXPECT_GT(met_some, 2000);
}

/// What other solids hide stays hidden, however a form is traced.
TEST(FormTracer, rays_that_are_met_already_stay_so) {
  const FreeForm form = joined(Join::unite, sphere({0, 0, 0}, 1), sphere({1, 0, 0}, 1));
  const std::vector<Ray> rays{{{-5, 0, 0}, {1, 0, 0}}, {{-5, 3, 0}, {1, 0, 0}}, {{-5, 3, 0}, {1, 0, 0}}};
  const std::vector<Segment> segments(rays.size(), {0, 20});
  for (const TraceMethod method : {TraceMethod::newton, TraceMethod::subdivision}) {
    std::vector<char> met{0, 1, 0};
    FormTracer(form, method).find_met(rays, segments, met);
    EXPECT_EQ(met, (std::vector<char>{1, 1, 0}));
  }
}

/// A union from which something is taken, as windows are from a hull: rays that do not come near what is
/// taken are met together, the others one by one.
TEST(FormTracer, rays_together_see_what_is_taken_from_a_union) {
  RandomForms forms(88);
  int crossings = 0, behind = 0;
  for (int n = 0; n < hunt(300); ++n) {
    const FreeForm whole =
        joined(Join::unite, ellipsoid({-0.3, 0, 0}, {1, 0.5, 0.6}), ellipsoid({0.4, 0, 0}, {0.4, 1.2, 0.5}));
    FreeForm form = whole;
    for (int k = 1 + forms.pick(3); k > 0; --k)
      form = joined(Join::subtract, form, sphere(forms.point(0.8), forms.uniform(0.1, 0.5)));
    if (n % 3 == 0) form = joined(Join::unite, form, sphere(forms.point(1), 0.3));
    const FormTracer tracer(form), of_whole(whole);
    Bundle b;
    const bool is_inside = n % 4 == 0;
    const Vec3d eye = is_inside ? forms.point(0.7) : 4.0 * normalize(forms.direction());
    const Segment segment{0, n % 5 == 0 && !is_inside ? 4.0 : 20.0};
    for (int i = 0; i < 64; ++i) b.add({eye, normalize(forms.point(1.3) - eye)}, segment);
    std::vector<double> t(b.rays.size());
    std::vector<char> met(b.rays.size(), 0);
    tracer.first_crossings(b.rays, b.segments, t);
    tracer.find_met(b.rays, b.segments, met);
    for (size_t i = 0; i < t.size(); ++i) {
      const std::optional<double> expected = tracer.first_crossing(b.rays[i], b.segments[i]);
      ASSERT_EQ(std::isfinite(t[i]), expected.has_value()) << "form " << n << ", ray " << i;
      ASSERT_EQ(met[i] != 0, expected.has_value()) << "form " << n << ", ray " << i;
      const std::optional<double> uncut = of_whole.first_crossing(b.rays[i], b.segments[i]);
      behind += uncut.has_value() && (!expected || *expected > *uncut + 1e-6);
      if (!expected) continue;
      ASSERT_NEAR(t[i], *expected, 1e-7) << "form " << n << ", ray " << i;
      ++crossings;
    }
  }
  EXPECT_GT(crossings, 3000);
  EXPECT_GT(behind, 300);
}

TEST(FormTracer, parts_hold_the_solid) {
  RandomForms forms(89);
  int crossings = 0, joined_of_parts = 0;
  for (int n = 0; n < hunt(100); ++n) {
    FreeForm form = perturbed(sphere(forms.point(1), 0.8), {{sphere(forms.point(1), 0.6), 0.8}});
    for (int k = forms.pick(4); k > 0; --k) {
      const Join join = forms.chance(0.6) ? Join::unite : Join::subtract;
      form = joined(join, form, ellipsoid(forms.point(2), {0.4, 1.5, 0.5}));
    }
    const FormTracer tracer(form);
    const std::vector<Box3d> parts = tracer.part_bounds();
    joined_of_parts += parts.size() > 1;
    for (int i = 0; i < 50; ++i) {
      const Vec3d eye = 6.0 * normalize(forms.direction());
      const Ray ray{eye, normalize(forms.point(2) - eye)};
      for (const Segment& stretch : tracer.inside(ray, {0, 20})) {
        const Vec3d middle = ray.at(0.5 * (stretch.t0 + stretch.t1));
        ASSERT_TRUE(std::any_of(parts.begin(), parts.end(),
                                [&](const Box3d& part) { return part.intersects(middle); }))
            << "form " << n << ", ray " << i;
        ++crossings;
      }
    }
  }
  EXPECT_GT(crossings, 1000);
  EXPECT_GT(joined_of_parts, 30);
}

/// Bounds over a stretch only shrink so fast: the documents' method looks far more often, and is as exact as
/// its last halving.
TEST(FormTracer, subdivision_agrees_and_takes_longer) {
  HostileRays hostile(84);
  TraceWork newton_work, subdivision_work;
  for (int n = 0; n < 20; ++n) {
    const FreeForm form = perturbed(sphere({0, 0, 0}, 1), {{sphere(hostile.forms().point(1), 0.6), 0.8},
                                                           {sphere(hostile.forms().point(1), 0.5), -0.7}});
    const FormTracer newton(form), subdivision(form, TraceMethod::subdivision);
    for (int k = 0; k < 50; ++k) {
      const Vec3d d = normalize(hostile.forms().direction());
      const Ray ray{hostile.forms().point(0.7) - 5.0 * d, d};
      const auto exact = newton.first_crossing(ray, {0, 10}, &newton_work);
      const auto halved = subdivision.first_crossing(ray, {0, 10}, &subdivision_work);
      if (!exact) continue;  // what halving cannot decide it takes for inside
      ASSERT_TRUE(halved);
      EXPECT_LE(*halved, *exact + 1e-12);
      const double steepness = std::fabs(dot(form.gradient(ray.at(*exact)), d));
      if (steepness > 0.5) {
        EXPECT_NEAR(*halved, *exact, 2e-5);
      }
    }
  }
  EXPECT_GT(subdivision_work.stretches, 4 * (newton_work.stretches + newton_work.values));
}

}  // namespace
}  // namespace pileus
