#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "tests/layering/rules.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = PILEUS_SOURCE_DIR;

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Everything that people write, by path from the root. The rules' own folder quotes what it forbids.
std::vector<SourceFile> project_files() {
  const std::set<std::string> extensions = {".h", ".cpp", ".txt", ".cmake", ".in", ".md", ".toml", ".py"};
  std::vector<SourceFile> files;
  const auto take = [&](const fs::path& file) {
    const std::string path = file.lexically_relative(kRoot).generic_string();
    const bool wanted = extensions.count(file.extension().string()) > 0 || file.filename() == "run";
    if (wanted && path.rfind("tests/layering/", 0) != 0) files.push_back({path, read_text(file)});
  };
  for (const fs::directory_entry& file : fs::directory_iterator(kRoot)) {
    if (file.is_regular_file()) take(file.path());
  }
  for (const char* folder : {".ci", "apps", "bench", "cmake", "docs", "integrators", "lib", "pileus",
                             "python", "samples", "shaders_cpu", "tests", "vdb_io"}) {
    if (!fs::is_directory(kRoot / folder)) continue;
    for (const fs::directory_entry& file : fs::recursive_directory_iterator(kRoot / folder)) {
      if (file.is_regular_file()) take(file.path());
    }
  }
  return files;
}

std::set<std::string> private_headers() {
  std::ifstream lines(kRoot / "cmake/private_headers.txt");
  std::set<std::string> headers;
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.front() != '#') headers.insert(line);
  }
  return headers;
}

TEST(Layering, the_project_keeps_its_rules) {
  const std::vector<SourceFile> files = project_files();
  EXPECT_GT(files.size(), 50u) << "too few files: is " << kRoot << " the source folder?";
  std::vector<std::string> complaints;
  for (const SourceFile& file : files) {
    for (std::string& complaint : broken_rules(file, private_headers()))
      complaints.push_back(std::move(complaint));
  }
  EXPECT_TRUE(complaints.empty()) << fmt::format("{}", fmt::join(complaints, "\n"));
}

TEST(Layering, private_headers_exist) {
  for (const std::string& header : private_headers()) {
    EXPECT_TRUE(fs::is_regular_file(kRoot / header)) << header;
  }
}

/// Keys that `ref:` comments cite, such as max1995.
std::set<std::string> cited_keys(const std::string& text) {
  static const std::regex line("\\bref:([^\n]*)"), key("\\b[a-z]+(19|20)[0-9]{2}\\b");
  std::set<std::string> keys;
  for (std::sregex_iterator it(text.begin(), text.end(), line), end; it != end; ++it) {
    const std::string cited = (*it)[1];
    for (std::sregex_iterator k(cited.begin(), cited.end(), key); k != end; ++k) keys.insert(k->str());
  }
  return keys;
}

TEST(References, what_comments_cite_is_listed) {
  const std::string list = read_text(kRoot / "docs/references.bib");
  for (const SourceFile& file : project_files()) {
    for (const std::string& key : cited_keys(file.text)) {
      EXPECT_NE(list.find("{" + key + ","), std::string::npos) << file.path << " cites " << key;
    }
  }
}

TEST(References, keys_are_found_in_comments) {
  EXPECT_EQ(cited_keys("/// ref:     max1995 sec. 2, porter1984\nx1990"),
            (std::set<std::string>{"max1995", "porter1984"}));
}

/// The complaints about a made-up file, one per line.
std::string complaints(const std::string& path, const std::string& text) {
  const std::set<std::string> private_headers = {"lib/scene/secret.h"};
  return fmt::format("{}", fmt::join(broken_rules({path, text}, private_headers), "\n"));
}

TEST(LayeringRules, includes_follow_the_arrows) {
  EXPECT_EQ(complaints("lib/scene/a.cpp", "#include \"lib/core/error.h\"\n"), "");
  EXPECT_EQ(complaints("apps/a.cpp", "#include \"lib/core/error.h\"\n#include \"pileus/pileus.h\"\n"), "");
  EXPECT_EQ(complaints("lib/core/a.h", "#include \"lib/math/vec.h\"\n"), "");
  EXPECT_EQ(complaints("lib/core/a.h", "\n#include \"lib/math/ray.h\"\n"),
            "lib/core/a.h:2: lib/core includes \"lib/math/ray.h\"; expected only what lies below it");
  EXPECT_NE(complaints("lib/scene/a.cpp", "#include \"vdb_io/a.h\"\n"), "");
  EXPECT_NE(complaints("lib/volume/a.cpp", "#include \"lib/cloud/a.h\"\n"), "");
  EXPECT_NE(complaints("integrators/a.cpp", "#include \"vdb_io/a.h\"\n"), "");
  EXPECT_NE(complaints("vdb_io/a.cpp", "#include \"shaders_cpu/a.h\"\n"), "");
  EXPECT_NE(complaints("shaders_cpu/phase/a.cpp", "#include \"integrators/a.h\"\n"), "");
  EXPECT_NE(complaints("integrators/a.cpp", "  #  include \"pileus/pileus.h\"\n"), "");
}

TEST(LayeringRules, includes_start_at_the_root) {
  EXPECT_EQ(complaints("lib/core/a.cpp", "#include \"a.h\"\n"),
            "lib/core/a.cpp:1: includes \"a.h\"; expected a path from the project's root");
  EXPECT_NE(complaints("lib/core/a.cpp", "#include \"../math/vec.h\"\n"), "");
  EXPECT_NE(complaints("lib/new_folder/a.cpp", ""), "");
}

TEST(LayeringRules, each_library_has_its_folder) {
  EXPECT_EQ(complaints("vdb_io/openvdb/a.cpp", "#include <openvdb/openvdb.h>\n"), "");
  EXPECT_EQ(complaints("lib/image/a.cpp", "#include <ImfOutputFile.h>\n"), "");
  EXPECT_EQ(complaints("integrators/kernels/a.cpp", "#include \"hwy/highway.h\"\n"), "");
  EXPECT_EQ(
      complaints("lib/core/a.cpp", "#include <fmt/format.h>\n#include <ImathVec.h>\n#include <vector>\n"),
      "");
  EXPECT_EQ(complaints("lib/core/a.cpp", "#include <openvdb/openvdb.h>\n"),
            "lib/core/a.cpp:1: includes <openvdb/openvdb.h>; OpenVDB is known only to vdb_io/openvdb, tests");
  EXPECT_NE(complaints("vdb_io/a.cpp", "#include <tbb/parallel_for.h>\n"), "");
  EXPECT_NE(complaints("apps/a.cpp", "#include <toml++/toml.h>\n"), "");
  EXPECT_NE(complaints("lib/scene/a.cpp", "#include <CLI/CLI.hpp>\n"), "");
  EXPECT_NE(complaints("integrators/a.cpp", "#include <nanovdb/NanoVDB.h>\n"), "");
  EXPECT_NE(complaints("lib/volume/a.cpp", "#include <OpenEXR/ImfHeader.h>\n"), "");
}

TEST(LayeringRules, public_headers_show_only_fmt_and_imath) {
  EXPECT_EQ(complaints("lib/scene/secret.h", "#include <toml++/toml.h>\n"), "");
  EXPECT_EQ(complaints("lib/scene/a.cpp", "#include \"lib/scene/secret.h\"\n"), "");
  EXPECT_EQ(complaints("vdb_io/openvdb/grid_to_field.h", "#include <openvdb/openvdb.h>\n"), "");
  EXPECT_NE(complaints("lib/scene/open.h", "#include <toml++/toml.h>\n"), "");
  EXPECT_NE(complaints("lib/scene/open.h", "#include \"lib/scene/secret.h\"\n"), "");
  EXPECT_NE(complaints("vdb_io/read.h", "#include <openvdb/openvdb.h>\n"), "");
}

TEST(LayeringRules, cancellation_is_refused) {
  EXPECT_EQ(complaints("lib/math/a.cpp", "x = -std::expm1(-t) + std::log1p(-x); // 1 - exp(-t)\n"), "");
  EXPECT_EQ(complaints("lib/math/a.cpp", "a = 2.1 - exp(t); b = exp(t) - 10; c = exp(t - 1);\n"), "");
  EXPECT_EQ(complaints("lib/math/a.cpp", "x = 1.0 - std::exp(-t);\n"),
            "lib/math/a.cpp:1: found \" 1.0 - std::exp(\"; expected: -expm1(x)");
  for (const char* line : {"(1 - exp(-t))", "1.0f-expf(t)", "std::exp(t) - 1.0", "exp(-a*b) - 1;",
                           "std::log(1.0 - x)", "log( 1 + x)", "1. - exp2(x)"}) {
    EXPECT_NE(complaints("shaders_cpu/a.cpp", line), "") << line;
    EXPECT_EQ(complaints("tests/reference/a.cpp", line), "") << line;
  }
}

TEST(LayeringRules, the_library_neither_prints_nor_exits) {
  for (const char* line : {"std::cout << x;", "fprintf(stderr, s);", "std::exit(1);", "abort();"}) {
    EXPECT_NE(complaints("lib/core/a.cpp", line), "") << line;
    EXPECT_EQ(complaints("apps/a.cpp", line), "") << line;
  }
  EXPECT_EQ(complaints("lib/core/a.cpp", "on_exit_code(); text = \"printf(\"; snprintf(a, 1, b);"), "");
}

TEST(LayeringRules, nothing_is_unfinished_or_tied_to_a_machine) {
  EXPECT_NE(complaints("docs/a.md", "TODO: write this"), "");
  EXPECT_NE(complaints("lib/core/a.cpp", "// FIXME later"), "");
  EXPECT_NE(complaints("CMakeLists.txt", "set(x /home/someone/x)"), "");
  EXPECT_NE(complaints("CMakeLists.txt", "add_compile_options(-ffast-math)"), "");
  EXPECT_EQ(complaints("docs/a.md", "https://example.org/home/x is a page, not a folder"), "");
}

TEST(LayeringRules, files_are_read_in_one_sitting) {
  EXPECT_EQ(complaints("lib/core/a.cpp", std::string(500, '\n')), "");
  EXPECT_EQ(complaints("lib/core/a.cpp", std::string(501, '\n')),
            "lib/core/a.cpp:501: 501 lines; expected 500 at most");
}

TEST(CodeOnly, blanks_comments_and_strings) {
  EXPECT_EQ(code_only("a // b\nc"), "a     \nc");
  EXPECT_EQ(code_only("a /* b\n */ c"), "a     \n    c");
  EXPECT_EQ(code_only("f(\"x // \\\" y\", 'c');"), "f(           ,    );");
  EXPECT_EQ(code_only("R\"(a\"b)\" + c"), "         + c");
  EXPECT_EQ(code_only("#include \"a/b.h\"  // c\n"), "#include \"a/b.h\"  // c\n");
  EXPECT_EQ(code_only("x = 1'000; y = '\\'';"), "x = 1'000; y =     ;");
  EXPECT_EQ(code_only("\"open"), "     ");
  EXPECT_EQ(code_only("// #include \"a/b.h\"\n"), "                   \n");
}

}  // namespace
}  // namespace pileus
