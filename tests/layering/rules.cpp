#include "tests/layering/rules.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <regex>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace pileus {
namespace {

constexpr int kMaxLines = 500;

/// Which folders a folder may include, besides itself; arrows are followed.
const std::map<std::string, std::vector<std::string>> kArrows = {
    {"lib/core", {}},
    {"lib/math", {"lib/core"}},
    {"lib/simd", {"lib/math"}},
    {"lib/noise", {"lib/simd"}},
    {"lib/freeform", {"lib/simd"}},
    {"lib/fog", {"lib/simd"}},
    {"lib/geom", {"lib/simd"}},
    {"lib/image", {"lib/simd"}},
    {"lib/cloud", {"lib/noise", "lib/freeform", "lib/geom", "lib/image"}},
    {"lib/volume", {"lib/noise", "lib/freeform", "lib/geom", "lib/image"}},
    {"lib/terrain", {"lib/noise", "lib/freeform", "lib/geom", "lib/image"}},
    {"lib/texture", {"lib/noise", "lib/image"}},
    {"lib/scene", {"lib/cloud", "lib/fog", "lib/volume", "lib/terrain", "lib/texture"}},
    {"shaders_cpu", {"lib/scene"}},
    {"vdb_io", {"lib/scene"}},
    {"integrators", {"shaders_cpu"}},
    {"pileus", {"integrators", "vdb_io"}},
    {"apps", {"pileus"}},
    {"bench", {"pileus"}},
    {"python", {"pileus"}},
    {"samples", {"pileus"}},
    {"tests", {"apps", "bench", "python", "samples"}},
};

/// Vectors are vocabulary, not mathematics: parameters have them, so the one header lies open to lib/core.
const std::set<std::string> kOpenHeaders = {"lib/math/vec.h"};

/// A third-party library: how its includes begin, and the folders that may know it.
struct Library {
  std::string name;
  std::regex include;
  std::vector<std::string> folders;
};
const std::vector<Library> kLibraries = {
    {"OpenVDB", std::regex("openvdb/.*"), {"vdb_io/openvdb", "tests"}},
    {"NanoVDB", std::regex("nanovdb/.*"), {"vdb_io", "tests"}},
    {"OpenEXR", std::regex("(OpenEXR/.*)|((Imf|Iex|IlmThread).*)"), {"lib/image", "tests"}},
    {"OpenImageIO", std::regex("OpenImageIO/.*"), {"lib/image/pictures"}},
    {"libpng", std::regex("png\\.h"), {"lib/image"}},
    {"toml++", std::regex("toml\\+\\+/.*"), {"lib/scene", "tests"}},
    {"TBB", std::regex("(oneapi/)?tbb/.*"), {"lib/core"}},
    {"assimp", std::regex("assimp/.*"), {"lib/geom/meshes"}},
    {"Embree", std::regex("embree[0-9]/.*"), {"lib/geom"}},
    {"Highway",
     std::regex("hwy/.*"),
     {"lib/simd", "lib/noise/kernels", "lib/freeform/kernels", "lib/volume/kernels", "integrators/kernels",
      "bench/micro/kernels", "tests"}},
    {"GDAL", std::regex("gdal.*"), {"lib/terrain"}},
    {"ctemplate", std::regex("ctemplate/.*"), {"apps"}},
    {"CLI11", std::regex("CLI/.*"), {"apps", "tests"}},
    {"pybind11", std::regex("pybind11/.*"), {"python"}},
    {"nlohmann/json", std::regex("nlohmann/.*"), {"lib", "vdb_io", "pileus", "apps", "bench", "tests"}},
    {"GoogleTest", std::regex("g(test|mock)/.*"), {"tests"}},
    {"Google Benchmark", std::regex("benchmark/.*"), {"bench"}},
};

/// The one public header that shows OpenVDB, for programs that hand over grids of their own.
const std::string kOpenVdbHeader = "vdb_io/openvdb/grid_to_field.h";

/// A pattern that has no place in some files.
struct Ban {
  std::regex pattern;
  std::string instead;
};
#define NUMBER_ONE "1(\\.0*)?f?"
const std::vector<Ban> kCancellation = {
    {std::regex("(^|[^\\w.])" NUMBER_ONE "\\s*-\\s*(\\w+::)*exp2?f?\\("), "-expm1(x)"},
    {std::regex("\\bexp2?f?\\([^()]*\\)\\s*-\\s*" NUMBER_ONE "($|[^\\w.])"), "expm1(x)"},
    {std::regex("\\blogf?\\(\\s*" NUMBER_ONE "\\s*[-+]"), "log1p(x)"},
};
const std::vector<Ban> kOutput = {
    {std::regex("\\bstd::(cout|cerr|clog)\\b|\\bf?printf\\(|\\bf?puts\\("),
     "throw Error, or return what to say"},
    {std::regex("\\b(exit|_Exit|quick_exit|abort|terminate)\\("), "throw Error, or PILEUS_CHECK"},
};
const std::vector<Ban> kAnywhere = {
    {std::regex("\\b(TODO|FIXME|XXX|HACK)\\b"), "finish it, or leave it out"},
    {std::regex("(^|[^\\w.])/(home|root|work|Users)/"), "a path relative to the project"},
    {std::regex("-ffast-math|-Ofast"), "reassociate by hand"},
};

bool starts_with(const std::string& text, const std::string& prefix) {
  return text.compare(0, prefix.size(), prefix) == 0;
}

bool is_in(const std::string& path, const std::vector<std::string>& folders) {
  return std::any_of(folders.begin(), folders.end(),
                     [&](const std::string& folder) { return starts_with(path, folder + "/"); });
}

/// "lib/core/error.h" lies in lib/core, "shaders_cpu/phase/hg.cpp" in shaders_cpu.
std::string folder_of(const std::string& path) {
  const size_t first = path.find('/');
  if (first == std::string::npos) return "";
  if (path.substr(0, first) != "lib") return path.substr(0, first);
  return path.substr(0, path.find('/', first + 1));
}

bool may_include(const std::string& from, const std::string& to) {
  if (from == to) return true;
  const auto arrows = kArrows.find(from);
  return arrows != kArrows.end() &&
         std::any_of(arrows->second.begin(), arrows->second.end(),
                     [&](const std::string& next) { return may_include(next, to); });
}

/// Checks the #include lines of one C++ file.
class IncludeRules {
 public:
  IncludeRules(const std::string& path, const std::set<std::string>& private_headers)
      : m_path(path),
        m_private_headers(private_headers),
        m_is_public(path.ends_with(".h") && is_in(path, {"lib", "pileus", "vdb_io"}) &&
                    private_headers.count(path) == 0) {}

  /// What is wrong with including `target`; "" where nothing is.
  std::string complaint(const std::string& target, bool is_quoted) const {
    for (const Library& library : kLibraries) {
      if (std::regex_match(target, library.include)) return library_complaint(library, target);
    }
    if (!is_quoted) return "";
    const std::string folder = folder_of(target);
    if (kArrows.count(folder) == 0) {
      return fmt::format("includes \"{}\"; expected a path from the project's root", target);
    }
    if (!may_include(folder_of(m_path), folder) && kOpenHeaders.count(target) == 0) {
      return fmt::format("{} includes \"{}\"; expected only what lies below it", folder_of(m_path), target);
    }
    if (m_is_public && m_private_headers.count(target) > 0) {
      return fmt::format("a public header includes \"{}\", which is private", target);
    }
    return "";
  }

 private:
  std::string library_complaint(const Library& library, const std::string& target) const {
    if (!is_in(m_path, library.folders)) {
      return fmt::format("includes <{}>; {} is known only to {}", target, library.name,
                         fmt::join(library.folders, ", "));
    }
    if (m_is_public && !(m_path == kOpenVdbHeader && library.name == "OpenVDB")) {
      return fmt::format("a public header includes <{}>; expected fmt and Imath only, or a line in {}",
                         target, "cmake/private_headers.txt");
    }
    return "";
  }

  const std::string& m_path;
  const std::set<std::string>& m_private_headers;
  const bool m_is_public;
};

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

bool is_directive(const std::string& text, size_t line_start) {
  const size_t first = text.find_first_not_of(" \t", line_start);
  return first != std::string::npos && text[first] == '#';
}

/// End of the comment, string or character literal that starts at i; i where none does.
size_t literal_end(const std::string& text, size_t i) {
  const auto after = [&](const std::string& mark, size_t from) {
    const size_t found = text.find(mark, from);
    return found == std::string::npos ? text.size() : found + mark.size();
  };
  const bool in_word = i > 0 && (std::isalnum(static_cast<unsigned char>(text[i - 1])) || text[i - 1] == '_');
  if (text.compare(i, 2, "//") == 0) return std::min(text.find('\n', i), text.size());
  if (text.compare(i, 2, "/*") == 0) return after("*/", i + 2);
  if (text.compare(i, 2, "R\"") == 0 && !in_word) {
    const size_t open = after("(", i);
    return after(")" + text.substr(i + 2, open - i - 3) + "\"", open);
  }
  if (text[i] != '"' && (text[i] != '\'' || in_word)) return i;  // 1'000 holds a separator
  size_t end = i + 1;
  while (end < text.size() && text[end] != text[i] && text[end] != '\n') end += text[end] == '\\' ? 2 : 1;
  return std::min(end + 1, text.size());
}

/// Bans that hold for the code of a C++ file.
std::vector<Ban> code_bans(const std::string& path) {
  std::vector<Ban> bans;
  const bool is_library = is_in(path, {"lib", "vdb_io", "shaders_cpu", "integrators", "pileus"});
  if (is_library || is_in(path, {"apps", "samples"})) bans = kCancellation;
  const bool prints_before_abort = path == "lib/core/error.cpp";  // the end of a broken invariant
  if (is_library && !prints_before_abort) bans.insert(bans.end(), kOutput.begin(), kOutput.end());
  return bans;
}

}  // namespace

std::string code_only(const std::string& text) {
  std::string code = text;
  for (size_t i = 0; i < text.size();) {
    const bool at_line_start = i == 0 || text[i - 1] == '\n';
    if (at_line_start && is_directive(text, i)) {  // its quotes are no string
      i = std::min(text.find('\n', i), text.size());
      continue;
    }
    const size_t end = literal_end(text, i);
    for (size_t j = i; j < end; ++j) {
      if (code[j] != '\n') code[j] = ' ';
    }
    i = std::max(end, i + 1);
  }
  return code;
}

std::vector<std::string> broken_rules(const SourceFile& file, const std::set<std::string>& private_headers) {
  std::vector<std::string> complaints;
  const auto complain = [&](size_t line, const std::string& what) {
    complaints.push_back(fmt::format("{}:{}: {}", file.path, line, what));
  };
  const auto apply = [&](const std::vector<Ban>& bans, const std::vector<std::string>& lines) {
    for (size_t i = 0; i < lines.size(); ++i) {
      std::smatch match;
      for (const Ban& ban : bans) {
        if (std::regex_search(lines[i], match, ban.pattern)) {
          complain(i + 1, fmt::format("found \"{}\"; expected: {}", match.str(), ban.instead));
        }
      }
    }
  };

  const std::vector<std::string> lines = lines_of(file.text);
  if (lines.size() > kMaxLines) {
    complain(lines.size(), fmt::format("{} lines; expected {} at most", lines.size(), kMaxLines));
  }
  apply(kAnywhere, lines);
  if (!file.path.ends_with(".h") && !file.path.ends_with(".cpp")) return complaints;

  if (kArrows.count(folder_of(file.path)) == 0) complain(1, "lies in a folder that the layers do not know");
  const std::vector<std::string> code = lines_of(code_only(file.text));
  const IncludeRules includes(file.path, private_headers);
  static const std::regex include_line(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"].*)");
  for (size_t i = 0; i < code.size(); ++i) {
    std::smatch match;
    if (!std::regex_match(code[i], match, include_line)) continue;
    const std::string what = includes.complaint(match[2], match[1] == "\"");
    if (!what.empty()) complain(i + 1, what);
  }
  apply(code_bans(file.path), code);
  return complaints;
}

}  // namespace pileus
