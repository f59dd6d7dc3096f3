// Free forms as scenes write them: [freeform.NAME].
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "lib/core/error.h"
#include "lib/freeform/form_program.h"
#include "lib/freeform/free_form.h"
#include "lib/scene/scene.h"

namespace pileus {
namespace {

const std::string kHead = "pileus = 1\n[camera]\ntype = \"perspective\"\n";

Scene parse(const std::string& freeforms) {
  return parse_scene(kHead + freeforms, "s.toml", "");
}

FreeForm form(const std::string& freeforms, const std::string& name = "f") {
  return parse(freeforms).freeforms.at(name);
}

/// What is wrong, all of it; lines count from the first free form.
std::string problems(const std::string& freeforms) {
  try {
    parse(freeforms);
  } catch (const Error& error) {
    std::string text;
    for (const Diagnostic& problem : error.diagnostics()) {
      text += fmt::format("{}{}:{}: {}", text.empty() ? "" : "\n", problem.loc.line - 3, problem.loc.column,
                          problem.message);
    }
    return text;
  }
  return "";
}

TEST(FreeFormRecipe, every_shape_has_its_name) {
  const auto value = [](const std::string& base, const Vec3d& p) {
    return form("[freeform.f]\nbase = { " + base + " }").value(p);
  };
  EXPECT_DOUBLE_EQ(value("ellipsoid = { center = [1, 0, 0], radii = [2, 1, 1] }", {2, 0, 0}), 0.75);
  EXPECT_DOUBLE_EQ(value("sphere = { center = [0, 1, 0], radius = 2 }", {0, 2, 0}), 0.75);
  EXPECT_DOUBLE_EQ(value("cylinder = { axis = [0, 3, 0], radius = 2 }", {1, 9, 0}), 0.75);
  EXPECT_DOUBLE_EQ(
      value("cone = { apex = [0, 1, 0], axis = [0, 1, 0], radius = 1, height = 2 }", {0.5, 3, 0}), 0.75);
  EXPECT_DOUBLE_EQ(
      value("paraboloid = { vertex = [0, 1, 0], axis = [0, 1, 0], radius = 1, height = 2 }", {0.5, 3, 0}),
      0.75);
  EXPECT_DOUBLE_EQ(value("hyperboloid = { axis = [0, 1, 0], radius = 1, height = 2 }", {0.5, 2, 0}), 1.75);
  EXPECT_DOUBLE_EQ(
      value("hyperboloid = { axis = [0, 1, 0], radius = 1, height = 2, sheets = 2 }", {0.5, 4, 0}), 2.75);
  EXPECT_DOUBLE_EQ(value("plane = { point = [0, 1, 0], normal = [0, 2, 0], size = 4 }", {7, 0, 0}), 0.25);
  EXPECT_DOUBLE_EQ(value("plane_pair = { center = [0, 1, 0], normal = [0, 1, 0], thickness = 4 }", {7, 0, 0}),
                   0.75);
  EXPECT_DOUBLE_EQ(value("coefficients = { a11 = 1, a23 = 2, a34 = 3, a44 = 4 }", {5, 6, 7}),
                   25 + 2 * 42 + 21 + 4);
}

constexpr const char* kTwoBalls =
    "[freeform.a]\nbase = { sphere = { radius = 1 } }\n"
    "[freeform.b]\nbase = { sphere = { center = [1, 0, 0], radius = 1 } }\n";

TEST(FreeFormRecipe, forms_are_made_of_forms) {
  const Vec3d p(0.2, 0.1, 0.3);
  const double a = form(kTwoBalls, "a").value(p), b = form(kTwoBalls, "b").value(p);
  const auto value = [&](const std::string& text) {
    return form(std::string(kTwoBalls) + "[freeform.f]\n" + text).value(p);
  };
  EXPECT_DOUBLE_EQ(value("union = [\"a\", \"b\"]"), std::max(a, b));
  EXPECT_DOUBLE_EQ(value("intersection = [\"a\", \"b\"]"), std::min(a, b));
  EXPECT_DOUBLE_EQ(value("difference = [\"a\", \"b\"]"), std::min(a, -b));
  EXPECT_DOUBLE_EQ(value("union = [\"a\", \"b\"]\nsmooth = 0.5"),
                   (a + b + std::sqrt((a - b) * (a - b) + 0.25)) / 2);
  EXPECT_DOUBLE_EQ(value("intersection = [\"a\", \"b\"]\nalpha = 0"), a + b - std::sqrt(a * a + b * b));
  EXPECT_DOUBLE_EQ(value("morph = { from = \"a\", to = \"b\", beta = 0.25 }"), 0.75 * a + 0.25 * b);
  EXPECT_DOUBLE_EQ(value("base = { form = \"b\" }\nplace = { translate = [-1, 0, 0] }"), a);
  EXPECT_DOUBLE_EQ(value("base = { form = \"a\" }\n"
                         "perturb = [ { sphere = { radius = 2 }, factor = -0.5 } ]"),
                   a - 0.5 * std::pow(1 - p.length2() / 4, 3));
}

TEST(FreeFormRecipe, the_order_is_perturb_deform_place) {
  const FreeForm made = form(
      "[freeform.f]\nbase = { ellipsoid = { radii = [2, 1, 1] } }\n"
      "perturb = [ { sphere = { center = [2, 0, 0], radius = 1 }, factor = 1 } ]\n"
      "deform = [ { twist = { axis = [0, 0, 1], from = -2, to = -1, angle_deg = 90 } } ]\n"
      "place = { scale = [1, 1, 1], translate = [0, 0, 5] }\n");
  EXPECT_NEAR(made.value({0, 2, 5}), 1.0, 1e-12) << "the bump on +x has been turned to +y, then lifted";
  EXPECT_NEAR(made.value({0, -2, 5}), 0.0, 1e-12);
}

TEST(FreeFormRecipe, morphs_follow_the_time) {
  const FreeForm made =
      form(std::string(kTwoBalls) +
           "[freeform.f]\nmorph = { from = \"a\", to = \"b\", beta_over_time = [[1, 0], [3, 1]] }");
  const FreeForm a = form(kTwoBalls, "a"), b = form(kTwoBalls, "b");
  const Vec3d p(0.3, 0.2, 0.1);
  EXPECT_TRUE(made.changes_over_time());
  EXPECT_EQ(made.value(p), a.value(p));
  EXPECT_EQ(made.at(1).value(p), a.value(p));
  EXPECT_DOUBLE_EQ(made.at(2).value(p), (a.value(p) + b.value(p)) / 2);
  EXPECT_EQ(made.at(3).value(p), b.value(p));
  EXPECT_EQ(made.at(99).value(p), b.value(p));
}

TEST(FreeFormRecipe, mistakes_are_told_with_their_place_and_the_nearest_name) {
  EXPECT_EQ(
      problems("[freeform.f]\nbase = { elipsoid = {} }"),
      "2:10: freeform \"f\": base: unknown parameter \"elipsoid\"; expected ellipsoid, sphere, cylinder, "
      "cone, paraboloid, hyperboloid, plane, plane_pair, coefficients or form; nearest: ellipsoid");
  EXPECT_EQ(
      problems("[freeform.f]\n"),
      "1:1: freeform \"f\" has none; expected exactly one of base, union, intersection, difference or morph");
  EXPECT_EQ(problems("[freeform.f]\nbase = { sphere = {}, plane = {} }"),
            "2:8: freeform \"f\": base has sphere and plane; expected exactly one of ellipsoid, sphere, "
            "cylinder, cone, paraboloid, hyperboloid, plane, plane_pair, coefficients or form");
  EXPECT_EQ(problems("[freeform.f]\nbase = { sphere = {} }\nperturb = [ { sphere = { radius = \"2 m\" } } ]"),
            "3:35: freeform \"f\": perturb 1: sphere: radius = \"2 m\"; expected a number (> 0)");
  EXPECT_EQ(
      problems("[freeform.f]\nbase = { sphere = {} }\nplace = { rotate = [0, 90, 0] }"),
      "3:11: freeform \"f\": place: unknown parameter \"rotate\"; expected scale, rotate_deg or translate");
  EXPECT_EQ(problems("[freeform.f]\nbase = { cone = { axis = [0, 0, 0] } }"),
            "1:1: freeform \"f\": cone: axis is zero; expected a direction");
  EXPECT_EQ(problems("[freeform.f]\nbase = { sphere = {} }\ndeform = [ { bend = { from = 2, to = 1 } } ]"),
            "1:1: freeform \"f\": deform 1: from = 2 and to = 1; expected from < to");
  EXPECT_EQ(problems("[freeform.f]\nbase = { sphere = {} }\nperturb = { factor = 1 }"),
            "3:11: freeform \"f\": perturb = a table; expected a list of tables [{ ... }, ...]");
}

TEST(FreeFormRecipe, references_lead_somewhere_and_not_back) {
  const std::string balls = kTwoBalls;
  EXPECT_EQ(problems(balls + "[freeform.f]\nunion = [\"a\", \"bb\"]"),
            "6:15: freeform \"f\": there is no freeform \"bb\"; the scene has a, b or f; nearest: b");
  EXPECT_EQ(problems(balls + "[freeform.f]\nunion = [\"a\", 3]"),
            "6:15: freeform \"f\": union holds 3; expected the name of a freeform");
  EXPECT_EQ(problems(balls + "[freeform.f]\nunion = [\"a\"]"),
            "5:1: freeform \"f\": union names only \"a\"; expected at least two free forms");
  EXPECT_EQ(problems("[freeform.a]\nbase = { form = \"b\" }\n[freeform.b]\nbase = { form = \"a\" }"),
            "4:17: freeform \"b\" is made of itself: a, b, a; expected free forms that do not lead back");
  EXPECT_EQ(problems("[freeform.a]\nbase = { form = \"a\" }"),
            "2:17: freeform \"a\" is made of itself: a, a; expected free forms that do not lead back");
}

TEST(FreeFormRecipe, forms_that_double_each_other_end_somewhere) {
  std::string text = "[freeform.f0]\nbase = { sphere = {} }\n";
  for (int i = 1; i < 40; ++i) {
    text += fmt::format("[freeform.f{}]\nunion = [\"f{}\", \"f{}\"]\n", i, i - 1, i - 1);
  }
  EXPECT_NE(problems(text).find("is made of more than 20000 functions"), std::string::npos);
}

}  // namespace
}  // namespace pileus
