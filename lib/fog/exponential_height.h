#pragma once

namespace pileus {

// Extinction that falls off with height, sigma(z) = sigma_0 exp(-z / scale), along a ray that climbs by
// `rise` metres per metre from height z0 >= 0 and stays above 0. scale > 0; everything may be as small or as
// large as a double; no 0/0, no overflow on the way to a finite result. ref: METHODS 2.3, last paragraph

struct HeightProfile {
  double extinction = 0.0;  ///< sigma_0 [1/m]
  double scale = 1.0;       ///< rise over which it falls to 1/e [m]
};

/// sigma at the height z >= 0 [1/m].
double height_extinction(const HeightProfile& profile, double z);

/// Optical depth over a length s >= 0 of the ray; +inf where the integral diverges.
///   tau = sigma_0 exp(-min(z0, z1) / scale) s phi1(|z1 - z0| / scale),  z1 = z0 + rise s
double height_depth(const HeightProfile& profile, double z0, double rise, double s);

/// The inverse: the length at which the optical depth tau is reached; +inf where it never is.
double height_depth_inverse(const HeightProfile& profile, double z0, double rise, double tau);

}  // namespace pileus
