#include "vdb_io/openvdb/carried_volume.h"

#include <algorithm>
#include <set>

#include "lib/core/error.h"
#include "lib/core/version.h"
#include "vdb_io/openvdb/grid_edits.h"
#include "vdb_io/openvdb/resample.h"
#include "vdb_io/openvdb/vdb_reader.h"
#include "vdb_io/openvdb/vdb_writer.h"
#include "vdb_io/openvdb/volume_file.h"
#include "vdb_io/openvdb/volume_writer.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void wrong_usage(const std::string& message) {
  throw Error(ErrorKind::usage, SourceLoc{}, message);
}

bool is_dense(const fs::path& path) {
  const auto format = volume_format(path);
  return format && *format != VolumeFormat::vdb && *format != VolumeFormat::nvdb;
}

void check_output(const Conversion& conversion) {
  const fs::path& output = conversion.output;
  if (!volume_format(output)) {
    throw Error(ErrorKind::usage, output.string(),
                fmt::format("is no name for a volume; expected one that ends in {}", volume_extensions()));
  }
  std::vector<fs::path> inputs = conversion.merged;
  inputs.push_back(conversion.input);
  for (const fs::path& input : inputs) {
    std::error_code neither_exists;
    if (fs::equivalent(input, output, neither_exists)) {
      throw Error(ErrorKind::usage, output.string(), "is an input; expected another name for the output");
    }
  }
}

/// Why a grid cannot be carried over; "" where it can.
std::string why_not(const VdbGridEntry& entry) {
  static const std::set<std::string> kKnown{"float", "double", "int32", "int64",
                                            "bool",  "vec3s",  "vec3d", "vec3i"};
  if (entry.value_type == "points") return "holds points, not a volume";
  if (kKnown.count(entry.value_type) == 0) return "holds values of type " + entry.value_type;
  return entry.has_affine_map() ? "" : "has the transform " + entry.map_type;
}

/// Carries grids over, file by file.
class Carrier {
 public:
  Carrier(const Conversion& conversion, const Tell& tell) : m_conversion(conversion), m_tell(tell) {}

  CarriedVolume run() {
    take(m_conversion.input);
    for (const fs::path& file : m_conversion.merged) take(file);
    check_all_found();
    const std::string input = m_conversion.input.string();
    if (m_volume.grids.empty()) {
      throw Error(ErrorKind::file, input, "holds no grid that can be converted");
    }
    check_changes_did_something();
    rename();
    m_volume.metadata = read_volume_metadata(m_conversion.input);
    if (!m_volume.metadata["creator"]) {
      m_volume.metadata.insertMeta("creator", openvdb::StringMetadata(fmt::format("pileus {}", kVersion)));
    }
    return std::move(m_volume);
  }

 private:
  void take(const fs::path& file) {
    const VdbDirectory directory = read_volume_directory(file);
    for (const VdbGridEntry* entry : chosen(file, directory)) {
      CarriedGrid next{read_volume_grid(file, directory, *entry), entry->name, entry->base_name};
      next.grid->setName(entry->name);
      change(file, next);
      m_volume.grids.push_back(std::move(next));
    }
  }

  /// The grids of a file that are asked for: those named, else all, else (for files that hold one) the
  /// density.
  std::vector<const VdbGridEntry*> chosen(const fs::path& file, const VdbDirectory& directory) {
    if (!m_conversion.grids.empty()) return named(file, directory);
    if (is_dense(m_conversion.output)) {
      const VdbGridEntry& density = choose_grid(file, directory, "");
      if (directory.grids.size() > 1) {
        m_tell(fmt::format("{}: grid {} chosen among {}", file.string(), describe(density),
                           directory.grids.size()));
      }
      return {&density};
    }
    std::vector<const VdbGridEntry*> entries;
    for (const VdbGridEntry& entry : directory.grids) {
      const std::string reason = why_not(entry);
      if (reason.empty()) {
        entries.push_back(&entry);
      } else {
        m_tell(fmt::format("{}: grid \"{}\" left out: {}", file.string(), entry.name, reason));
      }
    }
    return entries;
  }

  std::vector<const VdbGridEntry*> named(const fs::path& file, const VdbDirectory& directory) {
    std::vector<const VdbGridEntry*> entries;
    for (const std::string& wanted : m_conversion.grids) {
      const VdbGridEntry* entry = find(file, directory, wanted);
      if (!entry) continue;
      m_found.insert(wanted);
      if (entry->name != wanted && entry->base_name != wanted) {
        m_tell(fmt::format("{}: grid {} taken for \"{}\"", file.string(), describe(*entry), wanted));
      }
      if (std::count(entries.begin(), entries.end(), entry) == 0) entries.push_back(entry);
    }
    return entries;
  }

  /// Null where the grid may still stand in another of several files.
  const VdbGridEntry* find(const fs::path& file, const VdbDirectory& directory,
                           const std::string& wanted) const {
    try {
      return &choose_grid(file, directory, wanted);
    } catch (const Error&) {
      if (m_conversion.merged.empty()) throw;
      return nullptr;
    }
  }

  void check_all_found() const {
    for (const std::string& wanted : m_conversion.grids) {
      if (m_found.count(wanted) > 0) continue;
      throw Error(ErrorKind::file, m_conversion.input.string(),
                  fmt::format("no grid \"{}\", nor in the merged files", wanted));
    }
  }

  void check_changes_did_something() const {
    const std::string input = m_conversion.input.string();
    if (m_conversion.changes.level_set_to_fog && !m_had_level_set) {
      throw Error(ErrorKind::usage, input, "--levelset-to-fog: none of the grids taken over is a level set");
    }
    if (m_conversion.changes.crop && m_had_voxels && !m_kept_voxels) {
      throw Error(ErrorKind::usage, input,
                  "--crop leaves no voxel of any grid; `pileus info` shows where they are");
    }
  }

  void crop(const fs::path& file, openvdb::GridBase& grid) {
    m_had_voxels = m_had_voxels || grid.activeVoxelCount() > 0;
    crop_grid(file, grid, *m_conversion.changes.crop);
    m_kept_voxels = m_kept_voxels || grid.activeVoxelCount() > 0;
  }

  void change(const fs::path& file, CarriedGrid& carried) {
    const GridChanges& changes = m_conversion.changes;
    openvdb::GridBase::Ptr& grid = carried.grid;
    if (changes.level_set_to_fog && grid->getGridClass() == openvdb::GRID_LEVEL_SET) {
      m_had_level_set = true;
      fill(file, carried);
    }
    change_values(file, carried);
    if (changes.crop) crop(file, *grid);
    if (changes.scale != 1.0) scale_grid(file, *grid, changes.scale);
    if (!changes.voxels) return;
    if (grid->getGridClass() == openvdb::GRID_STAGGERED) {
      m_tell(fmt::format("{}: grid \"{}\" was staggered; its vectors now stand at voxel centres",
                         file.string(), carried.name_in_file));
    }
    grid = resampled_grid(file, *grid, *changes.voxels);
  }

  void fill(const fs::path& file, CarriedGrid& carried) const {
    const openvdb::FloatGrid::Ptr distances = as_float(carried.grid);
    if (!distances) {
      throw Error(ErrorKind::file, file.string(),
                  fmt::format("grid \"{}\" is a level set of {}; expected one of numbers",
                              carried.name_in_file, carried.grid->valueType()));
    }
    m_tell(fmt::format("{}: {}", file.string(), turn_level_set_into_fog(file, *distances)));
    distances->setSaveFloatAsHalf(false);
    carried.grid = distances;
  }

  void change_values(const fs::path& file, const CarriedGrid& carried) {
    const GridChanges& changes = m_conversion.changes;
    openvdb::GridBase& grid = *carried.grid;
    const auto tell_of = [&](uint64_t voxels, const char* change, double value) {
      m_tell(fmt::format("{}: grid \"{}\": {} voxels {} {}", file.string(), carried.name_in_file, voxels,
                         change, value));
    };
    for_this(changes.nan, carried,
             [&](double value) { tell_of(replace_nan(file, grid, value), "set to", value); });
    for_this(changes.lowest, carried,
             [&](double value) { tell_of(raise_to(file, grid, value), "raised by --min", value); });
    for_this(changes.factors, carried, [&](double factor) { multiply_values(file, grid, factor); });
    for_this(changes.backgrounds, carried, [&](double value) { change_background(file, grid, value); });
  }

  /// Calls apply(number) for each number that is meant for this grid.
  template <class Apply>
  void for_this(const GridNumbers& numbers, const CarriedGrid& carried, const Apply& apply) {
    for (const auto& [name, number] : numbers) {
      if (carried.name_in_file == name || carried.base_name == name) apply(number);
    }
  }

  void rename() {
    for (const auto& [old_name, new_name] : m_conversion.changes.renamings)
      carried(old_name).grid->setName(new_name);
    const GridChanges& changes = m_conversion.changes;
    for (const GridNumbers* numbers :
         {&changes.nan, &changes.lowest, &changes.factors, &changes.backgrounds}) {
      for (const auto& [name, number] : *numbers) carried(name);  // a name that fits nothing is a mistake
    }
    std::set<std::string> names;
    for (const CarriedGrid& one : m_volume.grids) {
      if (names.insert(one.grid->getName()).second) continue;
      wrong_usage(
          fmt::format("two grids are called \"{}\"; choose with --grid, or name one anew with --rename",
                      one.grid->getName()));
    }
  }

  /// The grid that a file calls so.
  CarriedGrid& carried(const std::string& name) {
    std::vector<std::string> names;
    for (CarriedGrid& one : m_volume.grids) {
      if (one.name_in_file == name || one.base_name == name) return one;
      names.push_back(one.name_in_file);
    }
    const std::string nearest = nearest_name(name, names);
    wrong_usage(fmt::format("no grid \"{}\" is taken over; found {}{}", name, join_or(names),
                            nearest.empty() ? "" : "; nearest: " + nearest));
  }

  const Conversion& m_conversion;
  const Tell& m_tell;
  CarriedVolume m_volume;
  std::set<std::string> m_found;  ///< names of Conversion::grids that a file had
  bool m_had_level_set = false, m_had_voxels = false, m_kept_voxels = false;  ///< of those that changes want
};

}  // namespace

CarriedVolume carry_volume(const Conversion& conversion, const Tell& tell) {
  check_output(conversion);
  return Carrier(conversion, tell).run();
}

std::vector<WrittenGrid> write_carried(const Conversion& conversion, const CarriedVolume& volume,
                                       const Tell& tell) {
  std::vector<openvdb::GridBase::Ptr> grids;
  for (const CarriedGrid& carried : volume.grids) grids.push_back(carried.grid);
  for (const std::string& note : write_volume(conversion.output, grids, volume.metadata, conversion.write)) {
    tell(fmt::format("{}: {}", conversion.output.string(), note));
  }
  std::vector<WrittenGrid> written;
  for (const CarriedGrid& carried : volume.grids) {
    written.push_back(written_grid(*carried.grid));
    written.back().name_in_input = carried.name_in_file;
  }
  return written;
}

}  // namespace pileus
