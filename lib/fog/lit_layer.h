#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>

#include "lib/math/transmittance.h"

namespace pileus {

// A flat homogeneous layer of fog lit by the sun from above: METHODS 2.3. Lengths [m], extinctions [1/m] >=
// 0, angles by their sines. The printed forms divide by what may vanish and dim the sun as if all scattering
// happened on the ground; these have the limits B -> 0, grazing views and a sun on the horizon.

namespace detail {

/// An optical depth [1] that may be asked for where one factor is 0 and the other infinite: no fog wins.
template <std::floating_point T>
T depth_of(T extinction, T height, T sine) {
  return extinction > 0 && height > 0 ? extinction * height / sine : T(0);
}

}  // namespace detail

/// The integral of exp(-tau_view - tau_sun) along a segment inside the layer [m]: what it scatters towards
/// its near end, for a sun that gives one unit per metre at the top.
///   extinction:  B of the layer
///   depth_above: height of the layer's top over the near end, >= 0
///   length:      of the segment, may be infinite
///   rise:        sine of the ray's elevation, positive upwards
///   sun:         sine of the sun's elevation, 0 .. 1
template <std::floating_point T>
T lit_segment(T extinction, T depth_above, T length, T rise, T sun) {
  if (!(length > 0)) return 0;
  const T near_depth = detail::depth_of(extinction, depth_above, sun);
  // How fast both depths together grow along the ray; negative for rays steeper than the sun.
  const T growth = extinction > 0 ? extinction - extinction * rise / sun : T(0);
  const T change = growth != 0 ? growth * length : T(0);
  const T less = near_depth + std::min(change, T(0));
  const T dimmed = transmittance(std::max(less, T(0)));
  if (!(dimmed > 0)) return 0;
  if (std::abs(change) < T(0.5)) return dimmed * length * phi1(std::abs(change));
  return dimmed * (opacity_from_tau(std::abs(change)) / std::abs(growth));
}

/// The same from an eye at `eye_height` down to the ground, seen at a depression of sine `depression`: the
/// exact form of the fog light, divided by I_c S [m].
template <std::floating_point T>
T lit_layer_light(T extinction, T thickness, T eye_height, T depression, T sun) {
  const T height = std::min(eye_height, thickness);
  if (!(height > 0)) return 0;
  return lit_segment(extinction, thickness - height, height / depression, -depression, sun);
}

/// The legacy form: the sun is dimmed everywhere as on the ground. A lower bound, far too low in dense fog.
template <std::floating_point T>
T legacy_lit_layer_light(T extinction, T thickness, T eye_height, T depression, T sun) {
  const T height = std::min(eye_height, thickness);
  if (!(height > 0)) return 0;
  const T sun_depth = detail::depth_of(extinction, thickness, sun);
  const T view_depth = detail::depth_of(extinction, height, depression);
  if (!(view_depth > 0)) return height / depression;
  return transmittance(sun_depth) * (opacity_from_tau(view_depth) / extinction);
}

/// Light of a surface on the ground through the layer: exp(-B h / sin a) (A + I_c R exp(-B H / sin b)).
///   ambient: A; sunlit: I_c R, of the surface in full sun
template <std::floating_point T>
T object_light_through_layer(T ambient, T sunlit, T extinction, T thickness, T eye_height, T depression,
                             T sun) {
  const T view_depth = detail::depth_of(extinction, std::min(eye_height, thickness), depression);
  return transmittance(view_depth) *
         (ambient + sunlit * transmittance(detail::depth_of(extinction, thickness, sun)));
}

}  // namespace pileus
