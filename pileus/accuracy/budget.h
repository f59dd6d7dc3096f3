#pragma once

#include <string>
#include <vector>

#include "pileus/accuracy/measure.h"

namespace pileus {

/// The answer to "how accurate can it be in so much time?"
struct BudgetAnswer {
  AccuracyReference reference;
  AccuracyRun best;                   ///< the least RMSE of all that took no longer than asked
  std::vector<AccuracyRun> measured;  ///< on the way there
};

/// Searches every method for its finest setting that builds and renders within `seconds`: settings are made
/// four times finer (or coarser) until the limit lies between two of them, each timed once, then
/// interpolated. Without options.methods, integrators are taken as they come. Throws Error(failed) where
/// nothing is fast enough.
BudgetAnswer best_within(const Scene& scene, double seconds, const AccuracyOptions& options);

}  // namespace pileus
