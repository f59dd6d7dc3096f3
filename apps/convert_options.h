#pragma once

#include <string>
#include <utility>
#include <vector>

#include "vdb_io/conversion.h"

namespace CLI {
class App;
}

namespace pileus {

/// The options of `pileus convert` as the user wrote them.
struct ConvertOptions {
  Conversion conversion;  ///< all that needs no reading
  std::vector<std::string> renames, nan, lowest, factors, backgrounds;
  std::string resample, crop, frames;
  bool quiet = false;

  void add_to(CLI::App& command);

  /// The conversion with all texts read.
  /// errors: Error(usage) that names the option, what was found and what was expected
  Conversion read() const;
};

}  // namespace pileus
