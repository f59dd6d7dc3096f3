#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "pileus/accuracy/analysis.h"

namespace pileus {

/// A run, with what stands in its row besides.
struct RunRow {
  const AccuracyRun& run;
  bool is_on_front;
};

/// monostate: the run has no such figure.
using Cell = std::variant<std::monostate, std::string, double, uint64_t>;

/// A figure of a run under the name by which accuracy.csv and --json know it. Names stay.
struct Column {
  std::string_view name;
  std::string_view help;
  Cell (*value)(const RunRow&);
};

std::span<const Column> accuracy_columns();

/// RFC 4180: a header, a row per run, lines end in CR LF; what a run does not have is empty.
std::string to_csv(const AccuracyStudy& study, const AccuracyAnalysis& analysis);

}  // namespace pileus
