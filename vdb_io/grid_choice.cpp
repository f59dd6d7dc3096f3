#include "vdb_io/grid_choice.h"

#include <fmt/format.h>

#include "lib/core/error.h"
#include "vdb_io/grid_aliases.h"

namespace pileus {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& message) {
  throw Error(ErrorKind::file, path.string(), message);
}

std::string list_grids(const std::vector<const VdbGridEntry*>& grids) {
  std::string text;
  for (const VdbGridEntry* grid : grids) text += (text.empty() ? "" : ", ") + describe(*grid);
  return text.empty() ? "none" : text;
}

std::vector<const VdbGridEntry*> grids_where(const VdbDirectory& directory, auto predicate) {
  std::vector<const VdbGridEntry*> found;
  for (const VdbGridEntry& grid : directory.grids) {
    if (predicate(grid)) found.push_back(&grid);
  }
  return found;
}

bool is_fog(const VdbGridEntry& grid) {
  return grid.is_scalar() && (grid.grid_class == "fog volume" || grid.grid_class == "unknown");
}

const VdbGridEntry& find_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                              const std::string& wanted) {
  std::vector<std::string> names;
  for (const VdbGridEntry& grid : directory.grids) {
    if (grid.name == wanted) return grid;
    names.push_back(grid.name);
  }
  const auto same_base = grids_where(directory, [&](const auto& grid) { return grid.base_name == wanted; });
  if (same_base.size() == 1) return *same_base.front();
  if (same_base.size() > 1) {
    fail(path, fmt::format("{} grids are called \"{}\"; expected one of them by number: {}", same_base.size(),
                           wanted, list_grids(same_base)));
  }
  const auto aliases =
      grids_where(directory, [&](const auto& grid) { return means_the_same(grid.base_name, wanted); });
  if (aliases.size() == 1) return *aliases.front();
  const std::string nearest = nearest_name(wanted, names);
  fail(path, fmt::format("no grid \"{}\"; found {}{}", wanted,
                         list_grids(grids_where(directory, [](const auto&) { return true; })),
                         nearest.empty() ? "" : "; nearest: " + nearest));
}

}  // namespace

const VdbGridEntry& choose_grid(const std::filesystem::path& path, const VdbDirectory& directory,
                                const std::string& wanted) {
  if (!wanted.empty()) return find_grid(path, directory, wanted);
  if (directory.grids.empty()) fail(path, "holds no grids");
  const auto named_density =
      grids_where(directory, [](const auto& grid) { return grid.base_name == "density"; });
  if (named_density.size() == 1) return *named_density.front();
  const auto aliases = grids_where(
      directory, [](const auto& grid) { return is_fog(grid) && means_the_same(grid.base_name, "density"); });
  if (aliases.size() == 1) return *aliases.front();
  const auto fogs = grids_where(directory, is_fog);
  if (fogs.size() == 1) return *fogs.front();
  const auto scalars = grids_where(directory, [](const auto& grid) { return grid.is_scalar(); });
  if (directory.grids.size() == 1)
    return directory.grids.front();  // its own error will say what is wrong with it
  fail(path, fmt::format(
                 "no grid is named \"density\" and {} could be meant; found {}; choose with `grid = \"...\"`",
                 scalars.empty() ? "none" : "several",
                 list_grids(grids_where(directory, [](const auto&) { return true; }))));
}

void require_scalar(const std::filesystem::path& path, const VdbGridEntry& grid) {
  if (grid.is_scalar()) return;
  if (grid.value_type == "points") {
    fail(path,
         fmt::format(
             "grid \"{}\" holds points, not a volume; expected a scalar grid; rasterize the points to a "
             "density first (Houdini: VDB from Particles; Blender: Points to Volume)",
             grid.name));
  }
  if (grid.value_type.starts_with("vec")) {
    fail(path,
         fmt::format(
             "grid \"{}\" holds vectors ({}{}); expected a scalar grid; name one with `grid = \"...\"`, or "
             "write its length or one component as a float grid",
             grid.name, grid.value_type, grid.grid_class == "staggered" ? ", staggered" : ""));
  }
  fail(path, fmt::format("grid \"{}\" holds values of type {}; expected float, double, int32, int64 or bool",
                         grid.name, grid.value_type));
}

}  // namespace pileus
