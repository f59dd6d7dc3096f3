#pragma once

#include <string>
#include <vector>

#include "pileus/accuracy/analysis.h"

namespace pileus {

/// A diagram as gnuplot makes it.
struct Plot {
  std::string name;     ///< "error_seconds": the file's stem
  std::string caption;  ///< what is to be seen
  std::string script;
};

/// Error against seconds and against look-ups, and error against the setting with the fitted orders. A
/// diagram that would be empty is left out.
std::vector<Plot> accuracy_plots(const AccuracyStudy& study, const AccuracyAnalysis& analysis);

}  // namespace pileus
