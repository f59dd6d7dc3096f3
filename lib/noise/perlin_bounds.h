#pragma once

namespace pileus {

/// Least upper bound of |noise| over every assignment of gradients to a cell's corners, rounded up (it is
/// 1.03635…, reached off the cell's centre). The often quoted 1 is too small.
inline constexpr double kPerlinBound = 1.037;

// Upper bounds, over all places and assignments of gradients, of what the noise does per lattice unit; proved
// by subdivision in tests/lib/perlin_bound_test.cpp. All bounds hold for every gradient in the hull of the
// twelve, because noise is linear in the gradients. n_k is the derivative along axis k; sums run over the
// axes.

inline constexpr double kPerlinSlope = 3.8;           ///< |n_k|; 3.75 in the middle of a cell
inline constexpr double kPerlinCubeSlope = 5.45;      ///< sum |n_k|
inline constexpr double kPerlinCubeCurvature = 44.5;  ///< |sum n_kl d_k d_l| for |d_k| <= 1

}  // namespace pileus
