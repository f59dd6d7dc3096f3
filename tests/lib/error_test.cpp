#include "lib/core/error.h"

#include <gtest/gtest.h>

namespace pileus {
namespace {

TEST(Error, message_has_file_line_and_column) {
  const Error error(ErrorKind::scene, SourceLoc{"dusk.toml", 14, 5}, "unknown key \"fallof\"");
  EXPECT_STREQ(error.what(), "dusk.toml:14:5: error: unknown key \"fallof\"");
}

TEST(Error, leaves_out_an_unknown_line) {
  EXPECT_STREQ(Error(ErrorKind::file, "a.vdb", "is empty").what(), "a.vdb: error: is empty");
}

TEST(Error, several_diagnostics_are_a_line_each) {
  const Error error(ErrorKind::scene, {{{"a", 1, 2}, "x"}, {{"a", 3, 4}, "y"}});
  EXPECT_STREQ(error.what(), "a:1:2: error: x\na:3:4: error: y");
}

TEST(NearestName, finds_typing_slips) {
  const std::vector<std::string> names{"base", "falloff", "sigma_t"};
  EXPECT_EQ(nearest_name("fallof", names), "falloff");
  EXPECT_EQ(nearest_name("falolff", names), "falloff");
  EXPECT_EQ(nearest_name("bsae", names), "base");
}

TEST(NearestName, is_silent_about_unrelated_names) {
  EXPECT_EQ(nearest_name("temperature", {"base", "falloff"}), "");
  EXPECT_EQ(nearest_name("x", {"base"}), "");
}

TEST(JoinOr, reads_like_a_sentence) {
  EXPECT_EQ(join_or({"a"}), "a");
  EXPECT_EQ(join_or({"a", "b"}), "a or b");
  EXPECT_EQ(join_or({"a", "b", "c"}), "a, b or c");
}

}  // namespace
}  // namespace pileus
