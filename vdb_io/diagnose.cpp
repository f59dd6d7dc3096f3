#include "vdb_io/diagnose.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "lib/core/memory_budget.h"

namespace pileus {
namespace {

// Where numbers begin to look wrong. None of them is proof, so none is more than a warning.
constexpr double kDenseDensity = 10.0;  // simulations write 0 to 1, seldom a few times that
constexpr double kWarmestHeat = 10.0;   // relative heat: 0 to 1 or 2; what lies between is neither
constexpr double kColdestKelvin = 200.0;
constexpr double kStepPerFrame = 1.5;  // voxels: simulators keep what moves in a frame near one voxel
constexpr double kThinColumn = 0.1;    // optical depth at extinction 1 that shows next to nothing
constexpr double kSmallest = 0.01, kLargest = 1e5;  // usual extents [m]
constexpr double kFarDistance = 1e4;                // Blender writes this for "far away"
// What fixes of units assume; the user knows better.
constexpr double kKelvinOfHeat = 1000.0, kFramesPerSecond = 24.0;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

bool is_one_of(const VdbGridEntry& entry, std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), lower(entry.base_name)) != names.end();
}

bool is_heat(const VdbGridEntry& entry) {
  return is_one_of(entry, {"temperature", "temp", "heat", "flame", "flames", "fire"});
}

bool is_velocity(const VdbGridEntry& entry) {
  return is_one_of(entry, {"velocity", "vel", "v"});
}

bool has_density_name(const VdbGridEntry& entry) {
  return is_one_of(entry, {"density", "smoke", "soot", "fog", "cloud", "dust", "voxel_fog_density"});
}

bool is_level_set(const VdbGridEntry& entry) {
  return entry.grid_class == "level set";
}

/// Will be shown as a density, by its name or because a file without instructions means it.
bool is_density(const VdbReport& report, const VdbGridEntry& entry) {
  return has_density_name(entry) || entry.name == report.default_grid;
}

/// An argument as a shell reads it back.
std::string shell_quoted(const std::string& text) {
  constexpr std::string_view kPlain = "._-/=+,:@%";
  const bool is_plain = !text.empty() && std::all_of(text.begin(), text.end(), [&](unsigned char c) {
    return std::isalnum(c) || kPlain.find(char(c)) != std::string_view::npos;
  });
  if (is_plain) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

/// Four digits, as TOML and people read them.
std::string number_text(double value) {
  return fmt::format("{:.4g}", value);
}

class Diagnosis {
 public:
  Diagnosis(const std::filesystem::path& path, const VdbReport& report) : m_path(path), m_report(report) {}

  std::vector<Finding> run() {
    look_at_file();
    for (const GridReport& grid : m_report.grids) look_at_grid(grid);
    return std::move(m_findings);
  }

 private:
  Finding& add(Severity severity, const char* code, std::string message) {
    m_findings.push_back({severity, code, m_grid ? m_grid->entry.name : "", std::move(message), "", ""});
    return m_findings.back();
  }

  /// A fix that sets a key of the volume: as a line of a scene, and as a command that shows the bare file.
  void fix_in_scene(Finding& finding, const std::string& key, const std::string& value) const {
    const bool is_number =
        value.starts_with('[') || value.find_first_not_of("0123456789.e+-") == std::string::npos;
    finding.scene = key + " = " + (is_number ? value : '"' + value + '"');
    finding.fix = "pileus render " + shell_quoted(m_path.string());
    const bool must_choose = m_grid && m_grid->entry.name != m_report.default_grid && key != "grid";
    if (must_choose && m_report.directory.grids.size() > 1)
      finding.fix += " --set " + shell_quoted("volume.volume.grid=" + m_grid->entry.name);
    finding.fix += " --set " + shell_quoted("volume.volume." + key + "=" + value);
  }

  /// A fix that writes the file anew; what a scene would say instead comes on top.
  void fix_by_converting(Finding& finding, const std::vector<std::string>& options) const {
    const std::filesystem::path fixed = m_path.parent_path() / (m_path.stem().string() + "_fixed.vdb");
    finding.fix = "pileus convert " + shell_quoted(m_path.string()) + " " + shell_quoted(fixed.string());
    for (const std::string& option : options) finding.fix += " " + shell_quoted(option);
  }

  /// The same where a value of the grid under examination is changed.
  void fix_values(Finding& finding, const char* option, double value) const {
    fix_by_converting(finding, {option, fmt::format("{}={:.6g}", m_grid->entry.name, value)});
  }

  void fix_scale(Finding& finding, double factor) const {
    fix_in_scene(finding, "scale", fmt::format("[{0}, {0}, {0}]", number_text(factor)));
    fix_by_converting(finding, {"--scale", number_text(factor)});
  }

  void look_at_file() {
    const VdbDirectory& directory = m_report.directory;
    if (directory.grids.empty()) {
      add(Severity::error, "no_grids", "holds no grids");
      return;
    }
    if (m_report.default_grid.empty()) look_for_a_choice();
    for (const VdbGridEntry& grid : directory.grids) {
      if (grid.name == grid.base_name + "[0]") look_at_repeated(grid);
    }
    const auto creator = directory.metadata.find("creator");
    const std::string maker = creator == directory.metadata.end() ? "" : lower(creator->second);
    for (const char* program : {"bifrost", "maya", "embergen", "unreal"}) {
      if (maker.find(program) == std::string::npos) continue;
      Finding& finding =
          add(Severity::note, "centimetres",
              fmt::format("was made by {}, which may count in centimetres; pileus takes them as metres",
                          program));
      fix_scale(finding, 0.01);
    }
  }

  /// Several grids, or none, could be the density.
  void look_for_a_choice() {
    const VdbGridEntry* example = nullptr;
    for (const VdbGridEntry& grid : m_report.directory.grids) {
      const bool is_better = !example || (is_level_set(*example) && !is_level_set(grid));
      if (grid.is_scalar() && grid.has_affine_map() && is_better) example = &grid;
    }
    if (m_report.directory.grids.size() == 1) return;  // what is wrong with it stands with the grid
    if (!example) {
      add(Severity::warning, "no_density", "holds no grid that can be shown as a density");
      return;
    }
    Finding& finding = add(Severity::warning, "undecided",
                           "no grid is named \"density\" and several could be meant; choose one");
    fix_by_choosing(finding, *example);
  }

  void fix_by_choosing(Finding& finding, const VdbGridEntry& grid) const {
    fix_in_scene(finding, "grid", grid.name);
    std::vector<std::string> options{"--rename", grid.name + "=density"};
    if (is_level_set(grid)) options.push_back("--levelset-to-fog");
    fix_by_converting(finding, options);
  }

  void look_at_repeated(const VdbGridEntry& first) {
    const auto count =
        std::count_if(m_report.directory.grids.begin(), m_report.directory.grids.end(),
                      [&](const VdbGridEntry& grid) { return grid.base_name == first.base_name; });
    if (count < 2) return;
    Finding& finding =
        add(Severity::warning, "duplicate",
            fmt::format("has {} grids called \"{}\"; most programs read one of them and do not say which",
                        count, first.base_name));
    std::vector<std::string> options;
    for (int n = 0; n < count; ++n) {
      const std::string new_name = n == 0 ? first.base_name : fmt::format("{}_{}", first.base_name, n + 1);
      options.insert(options.end(), {"--rename", fmt::format("{}[{}]={}", first.base_name, n, new_name)});
    }
    if (first.is_scalar()) fix_in_scene(finding, "grid", first.name);
    fix_by_converting(finding, options);
  }

  void look_at_grid(const GridReport& grid) {
    m_grid = &grid;
    if (!grid.problem.empty()) {
      add(Severity::error, "unreadable", grid.problem);
    } else {
      look_at_type();
      if (grid.structure && grid.structure->active_voxels == 0) {
        Finding& finding =
            add(is_density(m_report, grid.entry) ? Severity::error : Severity::warning, "empty",
                "is empty (0 active voxels, so its bounding box is inverted); nothing to show");
        fix_by_leaving_out_empty(finding);
      } else {
        look_at_content();
      }
    }
    m_grid = nullptr;
  }

  void fix_by_leaving_out_empty(Finding& finding) const {
    std::vector<std::string> options;
    for (const GridReport& grid : m_report.grids) {
      if (!grid.problem.empty() || !grid.structure || grid.structure->active_voxels == 0) continue;
      options.push_back("--grid");
      options.push_back(grid.entry.name);
    }
    if (!options.empty()) fix_by_converting(finding, options);
  }

  void look_at_content() {
    if (m_grid->values) look_at_values(*m_grid->values);
    if (m_grid->vectors) look_at_vectors(*m_grid->vectors);
    look_at_statistics();
    look_at_size();
  }

  void look_at_type() {
    const VdbGridEntry& entry = m_grid->entry;
    const bool is_density_alone = m_report.directory.grids.size() == 1;
    if (entry.value_type == "points") {
      add(is_density_alone ? Severity::error : Severity::warning, "points",
          "holds points, not a volume: pileus cannot show it; rasterize the points to a density first "
          "(Houdini: VDB "
          "from Particles; Blender: Points to Volume)");
    } else if (!entry.is_scalar()) {
      add(Severity::note, "not_scalar",
          fmt::format("holds {} values: pileus shows scalar grids only", entry.value_type));
    }
    if (!entry.has_affine_map()) {
      add(is_density(m_report, entry) || is_density_alone ? Severity::error : Severity::warning, "transform",
          fmt::format(
              "has the transform {} ({}); expected an affine one; resample it to a box where it was made",
              entry.map_type,
              entry.map_type == "NonlinearFrustumMap" ? "a frustum: voxels widen with distance" : "unknown"));
    }
  }

  void look_at_values(const ValueReport& values) {
    const VdbGridEntry& entry = m_grid->entry;
    if (is_level_set(entry)) return look_at_level_set(values);
    if (is_misnamed_level_set(values)) {
      add(Severity::error, "level_set_as_density",
          fmt::format("holds signed distances ({} to {}, background {}), not a density, though its class "
                      "says {}; write "
                      "it again as a level set where it was made",
                      number_text(values.min), number_text(values.max), number_text(values.background),
                      entry.grid_class == "unknown" ? "nothing" : entry.grid_class));
      return;
    }
    look_at_bad_values(values);
    if (is_heat(entry)) look_at_heat(values);
    if (!is_density(m_report, entry)) return;
    if (values.background != 0.0) {
      Finding& finding = add(Severity::error, "background",
                             fmt::format("has the background {}: it would fill all of space; expected 0",
                                         number_text(values.background)));
      fix_values(finding, "--background", 0.0);
    }
    if (entry.grid_class == "unknown") add(Severity::note, "no_class", "has no class; taken as a fog volume");
    if (values.inactive_nonzero > 0) {
      add(Severity::warning, "inactive",
          fmt::format(
              "has {} inactive voxels that are not 0; they are interpolated like active ones, other programs "
              "may leave them out",
              values.inactive_nonzero));
    }
    look_at_depth(values);
  }

  void look_at_level_set(const ValueReport& values) {
    const VdbGridEntry& entry = m_grid->entry;
    if (values.nan + values.infinite > 0) {
      Finding& finding = add(Severity::error, "nan",
                             fmt::format("holds {} NaN and {} infinite distances; the fix takes them for far",
                                         values.nan, values.infinite));
      if (std::isfinite(values.background)) fix_values(finding, "--nan", values.background);
      return;
    }
    const bool is_wrong = has_density_name(entry);
    Finding& finding = add(
        is_wrong ? Severity::error : Severity::note, is_wrong ? "level_set_as_density" : "level_set",
        is_wrong ? "is called a density but is a level set (distances)" : "is a level set, not a density");
    fix_in_scene(finding, "level_set", "fog");
    fix_by_converting(finding, {"--levelset-to-fog"});
    if (values.max >= kFarDistance) {
      add(Severity::note, "far",
          fmt::format("has distances up to {}, which mean \"far\"; they stay outside the fog", values.max));
    }
  }

  /// Distances are negative inside, and the background is the width of their band.
  bool is_misnamed_level_set(const ValueReport& values) const {
    return values.background > 0.0 && values.min < 0.0 && values.nan == 0 &&
           values.max <= values.background * 1.001 && values.min >= -values.background * 1.001;
  }

  void look_at_bad_values(const ValueReport& values) {
    const bool density = is_density(m_report, m_grid->entry);
    if (values.nan + values.infinite > 0 || (density && values.negative > 0)) {
      Finding& finding = add(Severity::error, "nan",
                             fmt::format("holds {} NaN, {} infinite and {} negative values", values.nan,
                                         values.infinite, values.negative));
      if (density) fix_in_scene(finding, "nan", "zero");
      std::vector<std::string> options;
      for (const char* option : {"--nan", "--min"}) {
        if (option == std::string("--min") && !(density && values.negative > 0)) continue;
        if (option == std::string("--nan") && values.nan + values.infinite == 0) continue;
        options.insert(options.end(), {option, m_grid->entry.name + "=0"});
      }
      fix_by_converting(finding, options);
    } else if (values.negative > 0) {
      add(Severity::note, "negative", fmt::format("holds {} negative values", values.negative));
    }
    if (values.min == 0.0 && values.max == 0.0 && density) {
      add(Severity::warning, "all_zero", "is 0 in all its active voxels; nothing to show");
    }
  }

  void look_at_heat(const ValueReport& values) {
    if (!(values.max > 0.0)) return;
    const std::string range =
        fmt::format("runs from {} to {}", number_text(values.min), number_text(values.max));
    if (values.max <= kWarmestHeat) {
      Finding& finding =
          add(Severity::note, "heat_relative",
              range + ": relative heat, not kelvin; a black body needs kelvin (multiply by 1000 to 1500)");
      fix_values(finding, "--multiply", kKelvinOfHeat);
    } else if (values.max < kColdestKelvin) {
      add(Severity::warning, "heat_unit",
          range + ", which is neither relative heat (0 to 2) nor kelvin; is it in degrees Celsius?");
    } else {
      Finding& finding =
          add(Severity::note, "heat_kelvin",
              range + ": kelvin, it seems; programs that expect 0 to 2 need it divided by 1000");
      fix_values(finding, "--multiply", 1.0 / kKelvinOfHeat);
    }
  }

  void look_at_depth(const ValueReport& values) {
    if (values.max > kDenseDensity) {
      Finding& finding =
          add(Severity::warning, "dense",
              fmt::format("reaches {}, far above 1: kg/m3, or a percentage? Programs expect about 1",
                          number_text(values.max)));
      fix_in_scene(finding, "extinction", fmt::format("{:.2g}", 1.0 / values.max));
    }
    if (values.max_column && *values.max_column > 0.0 && *values.max_column < kThinColumn) {
      Finding& finding = add(Severity::warning, "thin", "is nearly invisible at extinction 1");
      fix_in_scene(finding, "extinction", fmt::format("{:.2g}", 5.0 / *values.max_column));
    }
  }

  void look_at_vectors(const VectorReport& vectors) {
    const VdbGridEntry& entry = m_grid->entry;
    if (vectors.nan + vectors.infinite > 0) {
      Finding& finding =
          add(Severity::error, "nan",
              fmt::format("holds {} NaN and {} infinite vectors", vectors.nan, vectors.infinite));
      fix_values(finding, "--nan", 0.0);
    }
    if (!is_velocity(entry) || !m_grid->voxel_size || !(vectors.max_length > 0.0)) return;
    const double voxels = vectors.max_length / m_grid->voxel_size->x;
    if (voxels > kStepPerFrame) return;
    Finding& finding = add(
        Severity::note, "velocity_per_frame",
        fmt::format("moves at most {} voxels per unit of time: per frame, it seems, not per second; programs "
                    "expect m/s "
                    "(multiply by the frame rate)",
                    number_text(voxels)));
    fix_values(finding, "--multiply", kFramesPerSecond);
  }

  /// What the file's own metadata claims about the grid, against what was counted.
  void look_at_statistics() {
    const auto claimed = m_grid->entry.metadata.find("file_voxel_count");
    if (claimed == m_grid->entry.metadata.end() || !m_grid->structure) return;
    const std::string counted = std::to_string(m_grid->structure->active_voxels);
    if (claimed->second == counted || claimed->second.starts_with('<')) return;
    Finding& finding = add(
        Severity::warning, "statistics",
        fmt::format("says in its metadata that it has {} active voxels, but has {}; programs that believe it "
                    "cut it off",
                    claimed->second, counted));
    fix_by_converting(finding, {});
  }

  void look_at_size() {
    if (!m_grid->voxel_size || !m_grid->structure) return;
    const Vec3d& voxel = *m_grid->voxel_size;
    const Box3i& box = m_grid->structure->active_bounds;
    double extent = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      extent = std::max(extent, (double(box.max[axis]) - box.min[axis] + 1.0) * voxel[axis]);
    }
    const double to_ten_metres = 10.0 / extent;
    if (extent < kSmallest || extent > kLargest) {
      Finding& finding = add(
          Severity::warning, "size",
          fmt::format("is {:.3g} m wide, which is unusual; if it was not meant in metres, scale it", extent));
      if (is_density(m_report, m_grid->entry)) fix_scale(finding, to_ten_metres);
    } else if (voxel == Vec3d(1.0) && is_density(m_report, m_grid->entry)) {
      Finding& finding =
          add(Severity::warning, "voxel_size_1",
              fmt::format("has voxels of exactly 1 m ({:.3g} m in all): its maker probably never set a "
                          "voxel size",
                          extent));
      fix_scale(finding, to_ten_metres);
    }
  }

  const std::filesystem::path& m_path;
  const VdbReport& m_report;
  const GridReport* m_grid = nullptr;  ///< under examination; null: the file as a whole
  std::vector<Finding> m_findings;
};

}  // namespace

const char* name_of(Severity severity) {
  switch (severity) {
    case Severity::note:
      return "note";
    case Severity::warning:
      return "warning";
    case Severity::error:
      break;
  }
  return "error";
}

std::vector<Finding> find_trouble(const std::filesystem::path& path, const VdbReport& report) {
  return Diagnosis(path, report).run();
}

}  // namespace pileus
