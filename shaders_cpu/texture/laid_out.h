#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "lib/core/param_table.h"
#include "lib/scene/texture.h"
#include "lib/texture/projection.h"
#include "lib/texture/texture_filter.h"

namespace pileus {

/// The part of a texture that lays something flat into space: parameters projection, tiles_u and tiles_v.
struct Layout {
  std::string projection_name = "planar";
  double tiles_u = 1.0, tiles_v = 1.0;

  void describe(ParamTable& params) {
    params.text("projection", projection_name, "how it is laid into space")
        .one_of({"planar", "spherical", "cylindrical"});
    params.number("tiles_u", tiles_u, "1", "repetitions from left to right").above(0).at_most(1e6);
    params.number("tiles_v", tiles_v, "1", "repetitions from top to bottom").above(0).at_most(1e6);
  }

  Projection projection() const {
    if (projection_name == "spherical") return Projection::spherical;
    return projection_name == "cylindrical" ? Projection::cylindrical : Projection::planar;
  }

  /// Goes once around an axis: left and right meet.
  bool is_closed_around() const { return projection() != Projection::planar && tiles_u == 1.0; }

  /// Reaches once from pole to pole: nothing lies beyond top and bottom.
  bool ends_at_poles() const { return projection() == Projection::spherical && tiles_v == 1.0; }

  struct Place {
    Vec2d uv;
    PictureArea area;
  };

  /// Where a point of the texture's space lies, in tiles.
  Place place(Projection how, const TexturedPoint& point) const {
    const PicturePlace at = project(how, point.p);
    const auto edge = [&](const Vec3d& e) { return Vec2d(tiles_u * dot(at.du, e), tiles_v * dot(at.dv, e)); };
    return {{tiles_u * at.uv.x, tiles_v * at.uv.y}, {edge(point.a), edge(point.b)}};
  }

  /// The mean of `f(place)` over what a pixel sees. Near an axis the meridians fan out and an area is no
  /// parallelogram in the picture: it is cut into parts that are, but for the one on the axis.
  template <class F>
  auto mean(Projection how, const TexturedPoint& point, F&& f) const {
    const int parts = how == Projection::planar ? 1 : parts_near_axis(how, point);
    if (parts == 1) return f(place(how, point));
    const double share = 1.0 / parts;
    auto sum = f(place(how, part(point, 0, 0, share)));
    for (int i = 1; i < parts * parts; ++i) sum += f(place(how, part(point, i % parts, i / parts, share)));
    return sum * (share * share);
  }

 private:
  /// So many along each edge that a part spans a 24th of a turn.
  static int parts_near_axis(Projection how, const TexturedPoint& point) {
    constexpr double kSpan = 1.0 / 24.0, kMost = 12.0;
    const Vec3d du = project(how, point.p).du;
    const double turns = std::fabs(dot(du, point.a)) + std::fabs(dot(du, point.b));
    return turns > kSpan ? int(std::ceil(std::min(turns / kSpan, kMost))) : 1;
  }

  static TexturedPoint part(const TexturedPoint& whole, int i, int j, double share) {
    const double along_a = (i + 0.5) * share - 0.5, along_b = (j + 0.5) * share - 0.5;
    return {whole.p + along_a * whole.a + along_b * whole.b, whole.n, share * whole.a, share * whole.b};
  }
};

}  // namespace pileus
