// What the README shows is what is built.
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

namespace pileus {
namespace {

std::string read(const std::string& name) {
  std::ifstream file(std::string(PILEUS_SOURCE_DIR) + "/" + name);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(Readme, shows_the_smallest_program_as_it_is) {
  const std::string program = read("samples/code/render.cpp");
  ASSERT_FALSE(program.empty());
  EXPECT_NE(read("README.md").find("```cpp\n" + program + "```\n"), std::string::npos)
      << "copy samples/code/render.cpp into README.md";
}

}  // namespace
}  // namespace pileus
