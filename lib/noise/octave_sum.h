#pragma once

namespace pileus {

/// What an octave sum adds up of each octave's noise n.
enum class OctaveSum {
  fbm,     ///< n: fractional Brownian motion
  billow,  ///< |n|: round where |n| is large, creased where n = 0, like a cauliflower
  ridged,  ///< (1 - |n|)^2: sharp ridges where n = 0
};

}  // namespace pileus
