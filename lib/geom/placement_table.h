#pragma once

#include <filesystem>
#include <vector>

#include "lib/math/vec.h"

namespace pileus {

/// A line of a table of places.
struct TablePlace {
  Vec3d position{0.0, 0.0, 0.0};  ///< [m]
  double scale = 1.0;             ///< > 0
  double turn_deg = 0.0;          ///< about the y axis
};

/// Reads a table of places: a line for each with x, y, z and, where given, scale and turn, between commas.
/// Empty lines and what follows a # are passed over, and so is a first line that starts with a letter: names
/// of columns. errors: Error(file) with the line
std::vector<TablePlace> read_placement_table(const std::filesystem::path& file);

}  // namespace pileus
