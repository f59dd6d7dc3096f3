#pragma once

#include <functional>
#include <vector>

#include "integrators/march_scene.h"

namespace pileus {

// Places in the picture at which it is measured what approximate depths towards the lights change.

/// A place where light is scattered towards the camera.
struct PilotPoint {
  Vec3d p;
  double share = 0.0;          ///< of its ray's pixel: opacity / points
  std::vector<double> depths;  ///< towards each light, as good as exact
  std::vector<float> weights;  ///< see MarchRay; those of lamps as they are here
};

struct PilotRay {
  Vec3d direction;
  std::vector<float> weights;  ///< of suns
  std::vector<PilotPoint> points;
  double scale = 1.0;  ///< how much its errors count
};

using Pilots = std::vector<PilotRay>;

/// Points on a pilot ray. Where nodes stand far apart, errors are alike along much of a ray, and few will do.
/// More of them average out more of the error, as the many samples of a ray do.
inline constexpr int kFewPoints = 4, kManyPoints = 12;

/// Optical depth from a point towards a light, by steps of about `step` cells.
double stepped_depth(const MarchWorld& march, size_t light, const Vec3d& p, double step);

/// Rays all over the picture that meet a medium, as dense as it takes to meet what is small.
Pilots trace_pilots(const World& world, const Vec2i& picture, const MarchWorld& march, int points);

/// Gives the points of a pilot the weights of all lights: those of the ray, and of lamps.
void set_point_weights(const MarchWorld& march, PilotRay& pilot);

/// Depths that count as true, anew: by steps that are short beside a voxel, or as the field tells them.
void take_fine_depths(const MarchWorld& march, Pilots& pilots);
void take_exact_depths(const MarchWorld& march, Pilots& pilots);

/// Change of the light from one light if its depth is not `exact` but `depth`;
/// where media overlap, of the most sensitive.
double change_of_light(const MarchWorld& march, const std::vector<float>& weights, size_t light, double depth,
                       double exact);

/// Optical depth towards a light, as somebody says.
using DepthAt = std::function<double(size_t light, const Vec3d& p)>;

/// What wrong depths change in a pixel, at worst. Of many pixels the worst errs several times as much as the
/// root mean square of the pilot rays, or, where errors gather in few places, somewhat more than the worst of
/// these.
double measured_error(const Pilots& pilots, const MarchWorld& march, const DepthAt& depth_at);

}  // namespace pileus
