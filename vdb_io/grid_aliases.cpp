#include "vdb_io/grid_aliases.h"

#include <algorithm>
#include <cctype>

namespace pileus {
namespace {

/// One row per quantity. A name stands in one row only.
const std::vector<std::vector<std::string>> kRows = {
    {"density", "dens", "d", "rho", "smoke", "smoke_density", "fog", "fog_density", "cloud", "soot",
     "voxel_fog_density"},
    {"temperature", "temp", "heat", "kelvin", "voxel_fog_temperature"},
    {"flame", "flames", "fire", "burn"},
    {"fuel", "fuel_level", "voxel_fog_fuel"},
    {"vel", "velocity", "v", "motion", "voxel_fog_velocity"},
    {"Cd", "color", "colour", "rgb", "albedo", "scattering_color"},
};

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

const std::vector<std::string>* row_of(const std::string& name) {
  for (const auto& row : kRows) {
    const bool is_in = std::any_of(row.begin(), row.end(),
                                   [&](const std::string& alias) { return lower(alias) == lower(name); });
    if (is_in) return &row;
  }
  return nullptr;
}

}  // namespace

std::vector<std::string> aliases_of(const std::string& name) {
  const auto* row = row_of(name);
  return row ? *row : std::vector<std::string>{name};
}

bool means_the_same(const std::string& a, const std::string& b) {
  if (lower(a) == lower(b)) return true;
  const auto* row = row_of(a);
  return row && row == row_of(b);
}

}  // namespace pileus
