#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "apps/limited_child.h"
#include "lib/core/error.h"
#include "lib/core/memory_budget.h"
#include "vdb_io/load_openvdb.h"

namespace pileus {
namespace {

constexpr const char* kExamples = R"(Examples:
  pileus info smoke.vdb                  what is in the file, and what to do about it
  pileus info cache.vdb --grid density   one grid only (much faster for large caches)
  pileus info smoke.vdb --json           the same for scripts
  pileus info smoke.vdb --check          the doctor: is it healthy, and if not, which command helps

The file is read by a child process under limits of memory (--memory) and time: a file that crashes the reader
is reported, not suffered. --trust reads it directly.

Exit code: 0; 1 where the file or a grid of it cannot be read, or where --check finds an error; 2 for wrong
usage.)";

struct InfoOptions {
  std::filesystem::path file;
  std::string grid;
  bool json = false, check = false, trust = false;
};

/// 1234567 → "1,234,567"
std::string grouped(uint64_t number) {
  std::string text = std::to_string(number);
  for (size_t place = 3; place < text.size(); place += 4) text.insert(text.size() - place, ",");
  return text;
}

/// Text from the file, safe for a terminal.
std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 32 || c == 127; }, ' ');
  return text;
}

std::string creator_of(const VdbReport& report) {
  const auto found = report.directory.metadata.find("creator");
  return found == report.directory.metadata.end() ? "" : printable(found->second);
}

std::string type_text(const VdbGridEntry& entry) {
  return fmt::format("{}{}, {}", entry.value_type, entry.saved_as_half ? " (saved as half)" : "",
                     entry.grid_class == "unknown" ? "no class" : entry.grid_class);
}

void print_row(const char* label, const std::string& value) {
  fmt::print("  {:<14} {}\n", label, value);
}

void print_structure(const GridStructure& structure) {
  const Box3i& box = structure.active_bounds;
  if (structure.active_voxels > 0) {
    print_row("dims", fmt::format("{} x {} x {}, from [{}, {}, {}]", int64_t(box.max.x) - box.min.x + 1,
                                  int64_t(box.max.y) - box.min.y + 1, int64_t(box.max.z) - box.min.z + 1,
                                  box.min.x, box.min.y, box.min.z));
  }
  print_row("active voxels", grouped(structure.active_voxels));
  print_row("tree", fmt::format("{} leaves, {} active tiles", grouped(structure.leaves),
                                grouped(structure.active_tiles)));
}

void print_values(const ValueReport& values) {
  print_row("memory", bytes_text(values.memory_bytes));
  print_row("range",
            fmt::format("{:.6g} to {:.6g}, background {:.6g}", values.min, values.max, values.background));
  print_row("bad values", fmt::format("{} NaN, {} infinite, {} negative", grouped(values.nan),
                                      grouped(values.infinite), grouped(values.negative)));
  if (values.max_column) {
    print_row("optical depth",
              fmt::format("{:.4g} at extinction 1 (longest axis-parallel line)", *values.max_column));
  }
}

void print_vectors(const VectorReport& vectors) {
  print_row("memory", bytes_text(vectors.memory_bytes));
  print_row("longest", fmt::format("{:.6g}", vectors.max_length));
  print_row("bad vectors",
            fmt::format("{} NaN, {} infinite", grouped(vectors.nan), grouped(vectors.infinite)));
}

void print_grid(const GridReport& grid) {
  const VdbGridEntry& entry = grid.entry;
  fmt::print("\n{}\n", entry.name);
  print_row("type", type_text(entry));
  print_row("codec", compression_text(entry.compression));
  if (!entry.shares_tree_with.empty()) print_row("shares voxels", "with " + entry.shares_tree_with);
  if (grid.voxel_size) {
    const Vec3d& size = *grid.voxel_size;
    print_row("voxel",
              fmt::format("{:.6g} x {:.6g} x {:.6g} m ({})", size.x, size.y, size.z, entry.map_type));
  } else {
    print_row("transform", entry.map_type);
  }
  if (grid.structure) print_structure(*grid.structure);
  if (grid.values) print_values(*grid.values);
  if (grid.vectors) print_vectors(*grid.vectors);
}

/// "is nearly invisible at extinction 1; in a scene: extinction = 50"
std::string sentence(const Finding& finding) {
  return printable(finding.message) +
         (finding.scene.empty() ? "" : "; in a scene: " + printable(finding.scene));
}

/// What is wrong with one grid, or ("") with the file as a whole.
void print_findings(const std::vector<Finding>& findings, const std::string& grid) {
  for (const Finding& finding : findings) {
    if (finding.grid != grid || finding.severity == Severity::note) continue;
    print_row(finding.code == "unreadable" ? "unreadable" : "warning", sentence(finding));
  }
}

size_t count_of(const std::vector<Finding>& findings, Severity severity) {
  return size_t(std::count_if(findings.begin(), findings.end(),
                              [&](const Finding& finding) { return finding.severity == severity; }));
}

/// "1 error", "2 errors".
std::string counted(const std::vector<Finding>& findings, Severity severity) {
  const size_t count = count_of(findings, severity);
  return fmt::format("{} {}{}", count, name_of(severity), count == 1 ? "" : "s");
}

/// The doctor's verdict, worst findings first.
void print_verdict(const std::vector<Finding>& findings) {
  fmt::print("\n{}: {}, {}, {}\n", count_of(findings, Severity::error) > 0 ? "ill" : "healthy",
             counted(findings, Severity::error), counted(findings, Severity::warning),
             counted(findings, Severity::note));
  for (const Severity severity : {Severity::error, Severity::warning, Severity::note}) {
    for (const Finding& finding : findings) {
      if (finding.severity != severity) continue;
      const std::string subject = finding.grid.empty() ? "the file" : printable(finding.grid);
      print_row(name_of(severity), subject + " " + sentence(finding));
      if (!finding.fix.empty()) print_row("", printable(finding.fix));
    }
  }
}

void print_table(const InfoOptions& options, const VdbReport& report) {
  const VdbDirectory& directory = report.directory;
  const std::string creator = creator_of(report);
  fmt::print("{}\n", printable(options.file.string()));
  print_row("file", fmt::format("{}, {}{}", bytes_text(directory.file_bytes), directory.format,
                                creator.empty() ? "" : ", by " + creator));
  print_row("grids",
            fmt::format("{}{}", directory.grids.size(),
                        report.default_grid.empty() ? "" : ", shown by default: " + report.default_grid));
  if (!options.check) print_findings(report.findings, "");
  for (const GridReport& grid : report.grids) {
    print_grid(grid);
    if (!options.check) print_findings(report.findings, grid.entry.name);
  }
  if (options.check) print_verdict(report.findings);
}

template <class Vector>
nlohmann::json to_array(const Vector& v) {
  return {v.x, v.y, v.z};
}

nlohmann::json to_json(const Finding& finding) {
  nlohmann::json json{
      {"severity", name_of(finding.severity)}, {"code", finding.code}, {"message", finding.message}};
  if (!finding.grid.empty()) json["grid"] = finding.grid;
  if (!finding.fix.empty()) json["fix"] = finding.fix;
  if (!finding.scene.empty()) json["scene"] = finding.scene;
  return json;
}

nlohmann::json to_json(const GridReport& grid) {
  const VdbGridEntry& entry = grid.entry;
  nlohmann::json json{{"name", entry.name},
                      {"type", entry.value_type},
                      {"class", entry.grid_class},
                      {"saved_as_half", entry.saved_as_half},
                      {"codec", compression_text(entry.compression)},
                      {"transform", entry.map_type}};
  if (!entry.shares_tree_with.empty()) json["shares_voxels_with"] = entry.shares_tree_with;
  if (!grid.problem.empty()) json["problem"] = grid.problem;
  if (grid.voxel_size) json["voxel_size"] = to_array(*grid.voxel_size);
  if (grid.structure) {
    const GridStructure& structure = *grid.structure;
    json["active_voxels"] = structure.active_voxels;
    json["active_tiles"] = structure.active_tiles;
    json["leaves"] = structure.leaves;
    if (structure.active_voxels > 0) {
      json["index_min"] = to_array(structure.active_bounds.min);
      json["index_max"] = to_array(structure.active_bounds.max);
    }
  }
  if (grid.values) {
    const ValueReport& values = *grid.values;
    json["memory_bytes"] = values.memory_bytes;
    json["background"] = values.background;
    json["min"] = values.min;
    json["max"] = values.max;
    json["nan"] = values.nan;
    json["infinite"] = values.infinite;
    json["negative"] = values.negative;
    json["inactive_nonzero"] = values.inactive_nonzero;
    if (values.max_column) json["optical_depth_at_extinction_1"] = *values.max_column;
  }
  if (grid.vectors) {
    json["memory_bytes"] = grid.vectors->memory_bytes;
    json["max_length"] = grid.vectors->max_length;
    json["nan"] = grid.vectors->nan;
    json["infinite"] = grid.vectors->infinite;
  }
  return json;
}

nlohmann::json to_json(const std::vector<Finding>& findings) {
  nlohmann::json json = nlohmann::json::array();
  for (const Finding& finding : findings) json.push_back(to_json(finding));
  return json;
}

void print(const nlohmann::json& json) {
  // Names in the file need not be UTF-8.
  fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

void print_json(const InfoOptions& options, const VdbReport& report) {
  const VdbDirectory& directory = report.directory;
  nlohmann::json json{
      {"file", options.file.string()},
      {"bytes", directory.file_bytes},
      {"format", directory.format},
      {"file_version", directory.file_version},
      {"library_version", fmt::format("{}.{}", directory.library_major, directory.library_minor)},
      {"creator", creator_of(report)},
      {"default_grid", report.default_grid},
      {"healthy", count_of(report.findings, Severity::error) == 0},
      {"findings", to_json(report.findings)},
      {"grids", nlohmann::json::array()}};
  for (const GridReport& grid : report.grids) json["grids"].push_back(to_json(grid));
  print(json);
}

/// What --check says of a file that cannot be read at all.
int report_unreadable(const InfoOptions& options, const char* code, const std::string& message) {
  const std::vector<Finding> findings{{Severity::error, code, "", message, "", ""}};
  if (options.json) {
    print({{"file", options.file.string()}, {"healthy", false}, {"findings", to_json(findings)}});
  } else {
    fmt::print("{}\n", printable(options.file.string()));
    print_verdict(findings);
  }
  return 1;
}

int look_into(const InfoOptions& options) {
  const VdbReport report = load_openvdb().inspect_vdb(options.file, options.grid);
  if (options.json) {
    print_json(options, report);
  } else {
    print_table(options, report);
  }
  if (options.check) return count_of(report.findings, Severity::error) > 0 ? 1 : 0;
  const bool has_problem = std::any_of(report.grids.begin(), report.grids.end(),
                                       [](const GridReport& grid) { return !grid.problem.empty(); });
  return has_problem ? 1 : 0;
}

int check(const InfoOptions& options) {
  try {
    return look_into(options);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::file) throw;
    return report_unreadable(options, "damaged", error.diagnostics().front().message);
  }
}

int run(const InfoOptions& options) {
  if (!options.trust) {
    std::error_code no_such_file;
    const uintmax_t bytes = std::filesystem::file_size(options.file, no_such_file);
    if (const auto end = split_off_limited_child(limits_for_reading(no_such_file ? 0 : bytes))) {
      if (end->death.empty()) return end->exit_code;
      if (options.check) return report_unreadable(options, "hostile", end->death);
      throw Error(ErrorKind::file, options.file.string(), end->death);
    }
  }
  return options.check ? check(options) : look_into(options);
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "info", "show what a volume file holds (.vdb, .nvdb, .df3, .npy, .raw), and what to watch out for");
  command->footer(kExamples);
  const auto options = std::make_shared<InfoOptions>();
  command->add_option("FILE", options->file, "the file")->required();
  command->add_option("--grid", options->grid, "look at this grid only");
  command->add_flag("--check", options->check,
                    "examine the file, and name a command for what is wrong with it");
  command->add_flag("--trust", options->trust,
                    "read the file in this process, without limits of memory and time");
  command->add_flag("--json", options->json, "print a report for programs");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace pileus
