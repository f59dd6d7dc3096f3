#pragma once

#include <filesystem>
#include <list>
#include <vector>

#include "lib/core/param_table.h"
#include "lib/math/affine.h"
#include "lib/scene/medium.h"

namespace pileus {

/// Where instances stand: a list, a table of a file, or both; all of them placed once more, together.
class Placements {
 public:
  void describe(ParamTable& params);

  /// The map from where the original stands to each place; one that moves all where no place is given.
  /// errors: Error(file) of the table; Error(scene) where a place flattens what stands there
  std::vector<Affine> placed_from_original() const;

 private:
  Placement m_all;
  std::list<Placement> m_each;
  std::filesystem::path m_file;
};

}  // namespace pileus
