#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "lib/math/affine.h"
#include "vdb_io/read_options.h"
#include "vdb_io/value_counts.h"
#include "vdb_io/vdb_directory.h"

namespace pileus {

// What is done about a grid that is to be rendered as a density, whichever library reads it: what is refused,
// what is changed, what is said about it. All of these throw Error(file).

using Notes = std::vector<std::string>;

/// choose_grid, with a note on the choice; turns level sets away unless they are wanted as fog.
const VdbGridEntry& choose_density(const std::filesystem::path& path, const VdbDirectory& directory,
                                   const VdbReadOptions& options, Notes& notes);

/// How the distances of a level set become densities: 0 outside and at the surface, 1 from three voxels
/// inwards, as wide as narrow bands usually are, whatever the background: some store "far" as 10000.
class FogOfLevelSet {
 public:
  /// errors: where distances are not finite, or the background is negative
  FogOfLevelSet(const std::filesystem::path& path, const std::string& grid, const ValueCounts& distances,
                float background, const Affine& world_from_index);

  float density(float distance) const;

  /// What was done, in a sentence.
  std::string note() const;

 private:
  std::string m_grid;
  double m_band;
};

/// Turns away empty grids and those with a background that is not 0; notes what is unusual about others.
///   active_voxels, background: after a level set has become fog
void accept_density(const std::filesystem::path& path, const VdbGridEntry& grid, uint64_t active_voxels,
                    float background, Notes& notes);

/// True where bad values are there, and are to become 0.
bool must_clear_bad_values(const std::filesystem::path& path, const VdbGridEntry& grid, BadValuePolicy policy,
                           const ValueCounts& found, Notes& notes);

/// 0 for bad values.
float cleared(float value);

}  // namespace pileus
