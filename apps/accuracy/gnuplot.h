#pragma once

#include <optional>
#include <string>

namespace pileus {

/// Whether gnuplot is there to run.
bool has_gnuplot();

/// What gnuplot writes to its standard output for a script. Throws Error(failed) where it fails.
std::string run_gnuplot(const std::string& script);

}  // namespace pileus
