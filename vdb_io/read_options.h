#pragma once

#include <string>

namespace pileus {

enum class LevelSetPolicy { refuse, to_fog };
enum class BadValuePolicy { refuse, to_zero };

/// Which grid of a volume file is read as a density, and what becomes of what is none.
struct VdbReadOptions {
  std::string grid{};  ///< "density", or "density[1]" where names repeat; "": see choose_grid
  LevelSetPolicy level_set = LevelSetPolicy::refuse;
  BadValuePolicy bad_values = BadValuePolicy::refuse;  ///< NaN, infinite and negative densities
};

}  // namespace pileus
