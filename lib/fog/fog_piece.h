#pragma once

#include <limits>

#include "lib/fog/exponential_height.h"
#include "lib/math/vec.h"

namespace pileus {

/// One stretch of a ray on which the extinction of a fog and its colour are one closed form. s = t - t0 is
/// the length from its near end.
struct FogPiece {
  enum class Law {
    constant,  ///< sigma
    linear,    ///< sigma + slope s
    height,    ///< height_extinction of a ray from height z0 that climbs by `rise`
    fade,      ///< 1 / (length - s): the transmittance falls linearly to 0 at s = length, and stays there
  };
  enum class Source {
    plain,   ///< colour + colour_slope * (optical depth from the near end)
    mean,    ///< legacy: everywhere half the sum of both ends, of which the far one is as for `plain`
    sunlit,  ///< colour * exp(-(sun_depth + sun_slope s)); for a constant extinction
  };

  double t0 = 0.0, t1 = std::numeric_limits<double>::infinity();  ///< [m]; t1 may be infinite
  Law law = Law::constant;
  double sigma = 0.0, slope = 0.0;  ///< [1/m], [1/m2]
  HeightProfile profile;
  double z0 = 0.0, rise = 0.0;  ///< [m], [1]
  double length = 0.0;          ///< [m]

  Source source = Source::plain;
  Rgb colour{0.0};        ///< [W/(m2 sr)]
  Rgb colour_slope{0.0};  ///< per unit of optical depth
  double sun_depth = 0.0, sun_slope = 0.0;
};

/// Extinction at s [1/m]; may be infinite at the end of a fade.
double extinction_at(const FogPiece& piece, double s);

/// Optical depth of the first s metres; may be infinite.
double depth_to(const FogPiece& piece, double s);

/// The inverse: the least s with that optical depth, +inf where the law never reaches it. t1 is not looked
/// at.
double depth_inverse(const FogPiece& piece, double tau);

/// How far the optical depth between s0 and s1 is from linear, at most: it is convex or concave by every law.
/// May be infinite.
double depth_bend(const FogPiece& piece, double s0, double s1);

/// The source function at s: what the fog shows where it is opaque [W/(m2 sr)].
Rgb source_at(const FogPiece& piece, double s);

/// What the light of the first s metres grows by there, per transmittance that is lost: the source function,
/// but for the legacy source. Monotone in s.
Rgb light_per_loss(const FogPiece& piece, double s);

/// Radiance that the first s metres send to the near end.
Rgb light_to(const FogPiece& piece, double s);

/// The piece from `from` on, from >= t0, which becomes its near end; it is the same fog there, except for the
/// legacy source, whose mean is taken anew.
FogPiece cut_before(const FogPiece& piece, double from);

}  // namespace pileus
