#include "lib/core/param_table.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "lib/scene/phase_function.h"

namespace pileus {
namespace {

/// One parameter of every type, with its default.
struct Everything {
  bool flag = true;
  int count = -3;
  double share = 0.25;
  std::string word = "left";
  std::filesystem::path file = "a.vdb";
  Vec2i size{3, 4};
  Vec3d vector{1, 0.5, -2};
  Rgb colour{0, 0, 1};
  std::vector<Vec2d> profile{{0, 0}, {1, 0.5}};
  std::string blob = "b";
  int inner = 7;
  std::shared_ptr<const PhaseFunction> phase;

  void describe(ParamTable& params) {
    params.boolean("flag", flag, "a switch");
    params.integer("count", count, "a number").at_least(-5);
    params.number("share", share, "m", "a part").above(0).at_most(1);
    params.text("word", word, "a side").one_of({"left", "middle", "right"});
    params.file("file", file, "a file").required();
    params.size("size", size, "pixels", "a size").below(9);
    params.vector("vector", vector, "m", "a place");
    params.rgb("colour", colour, "1", "a colour").at_least(0).below(2);
    params.points("profile", profile, "", "a profile");
    params.reference("blob", blob, "freeform", "a name");
    params.group(
        "group", [this](ParamTable& p) { p.integer("inner", inner, "a number within"); }, "a group");
    params.plugin<PhaseFunction>("phase", phase, "hg", "a plugin");
  }
};

struct Row {
  const char *name, *type, *value, *range;
};

TEST(ParamTable, says_name_type_default_and_range_of_every_parameter) {
  const Row rows[] = {{"flag", "boolean", "true", ""},
                      {"count", "integer", "-3", ">= -5"},
                      {"share", "number", "0.25", "0 < share <= 1"},
                      {"word", "string", "\"left\"", "left, middle or right"},
                      {"file", "file", "required", ""},
                      {"size", "[integer, integer]", "[3, 4]", "< 9"},
                      {"vector", "[number, number, number]", "[1, 0.5, -2]", ""},
                      {"colour", "[number, number, number]", "[0, 0, 1]", "0 <= colour < 2"},
                      {"profile", "[[number, number], ...]", "[[0, 0], [1, 0.5]]", ""},
                      {"blob", "name of a freeform", "\"b\"", ""},
                      {"group", "table", "", ""},
                      {"phase", "phase plugin", "{ type = \"hg\" }", ""}};
  Everything everything;
  ParamTable table;
  everything.describe(table);
  ASSERT_EQ(table.params().size(), std::size(rows));
  for (size_t i = 0; i < std::size(rows); ++i) {
    const Param& param = table.params()[i];
    EXPECT_EQ(param.name, rows[i].name);
    EXPECT_EQ(type_name(param), rows[i].type);
    EXPECT_EQ(value_text(param), rows[i].value) << param.name;
    EXPECT_EQ(range_text(param), rows[i].range) << param.name;
    EXPECT_NE(param.help, "");
    EXPECT_EQ(param.is_required, param.name == "file");
  }
}

TEST(ParamTable, values_are_those_of_the_moment) {
  Everything everything;
  everything.share = 0.75;
  ParamTable table;
  everything.describe(table);
  EXPECT_EQ(value_text(table.params()[2]), "0.75");
  *std::get<double*>(table.params()[2].target) = 1.0;
  EXPECT_EQ(everything.share, 1.0) << "a table is bound to its object";
}

TEST(ParamTable, groups_describe_themselves) {
  Everything everything;
  ParamTable table, inner;
  everything.describe(table);
  std::get<GroupSlot>(table.params()[10].target).describe(inner);
  ASSERT_EQ(inner.params().size(), 1u);
  EXPECT_EQ(value_text(inner.params()[0]), "7");
}

TEST(ParamTableDeathTest, refuses_two_parameters_of_one_name) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  int a = 0, b = 0;
  EXPECT_DEATH(
      {
        ParamTable table;
        table.integer("same", a, "one");
        table.integer("same", b, "another");
      },
      "internal error: !taken does not hold");
}

}  // namespace
}  // namespace pileus
