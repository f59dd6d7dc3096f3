#pragma once

#include <optional>
#include <span>
#include <vector>

namespace pileus {

/// What a run took and how far off its picture was.
struct CostError {
  double cost;   ///< [s], or look-ups
  double error;  ///< [radiance]
};

/// Which points no other point beats: none is at least as good in both and better in one. Points with a value
/// that is not finite are never on the front. is_on_front[point]
std::vector<bool> pareto_front(std::span<const CostError> points);

/// A value read off a method's measured points, and how it was come by.
struct ReadOff {
  enum class Kind {
    interpolated,  ///< between two points, on the straight line of a log-log plot
    at_most,       ///< the cheapest point is better already: it takes this much or less
    out_of_reach   ///< no point gets there
  };
  Kind kind = Kind::out_of_reach;
  double value = 0.0;
};

/// The cost at which a method reaches `error`.
ReadOff cost_at_error(std::span<const CostError> points, double error);

/// The error that a method has reached after `cost`: at_most where its most expensive point is cheaper yet.
ReadOff error_at_cost(std::span<const CostError> points, double cost);

}  // namespace pileus
