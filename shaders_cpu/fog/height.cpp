/// Fog that thins out exponentially with height, without an end.
///
///   sigma(y) = extinction * exp(-(y - base) / scale_height)   above the base
///   sigma(y) = extinction                                     below it
///
///   base           height of full extinction                      [m]           default 0
///   scale_height   rise over which the extinction falls to 1/e    [m]           > 0, default 100
///   extinction     at the base and below                          [1/m]         >= 0, default 0.001
///   colour         of the fog where it is opaque                  [W/(m2 sr)]   >= 0, default [0.6, 0.7,
///   0.8]
///
///   [fog.ground]
///   type = "height"
///   scale_height = 60
///   extinction = 0.004
///
/// In closed form, with its inverse, for every direction, the horizontal one included. The volume
/// `height_fog` is the same density as a medium that scatters the light of the scene. Flat: beyond some 50 km
/// the curvature of the earth would count. ref: METHODS 2.3; docs/fog.md
#include <limits>

#include "lib/core/param_table.h"
#include "lib/scene/fog_model.h"

namespace pileus {
namespace {

struct ExponentialHeightFog final : FogModel {
  double m_base = 0.0, m_scale_height = 100.0, m_extinction = 0.001;
  Rgb m_colour{0.6, 0.7, 0.8};

  void describe(ParamTable& params) override {
    params.number("base", m_base, "m", "height of full extinction");
    params.number("scale_height", m_scale_height, "m", "rise over which the extinction falls to 1/e")
        .above(0);
    params.number("extinction", m_extinction, "1/m", "at the base and below").at_least(0);
    params.rgb("colour", m_colour, "W/(m2 sr)", "radiance of the fog where it is opaque").at_least(0);
  }
  bool is_visible() const override { return m_extinction > 0.0; }

  void append_pieces(const Ray& ray, const FogView&, std::vector<FogPiece>& pieces) const override {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    const double z = ray.o.y - m_base, rise = ray.d.y;
    if (z >= 0.0) {
      const double crossing = rise < 0.0 ? z / -rise : kNever;
      pieces.push_back(above(0.0, crossing, z, rise));
      pieces.push_back(below(crossing, kNever));
    } else {
      const double crossing = rise > 0.0 ? -z / rise : kNever;
      pieces.push_back(below(0.0, crossing));
      pieces.push_back(above(crossing, kNever, 0.0, rise));
    }
  }

 private:
  FogPiece above(double t0, double t1, double z, double rise) const {
    FogPiece piece;
    piece.t0 = t0, piece.t1 = t1;
    piece.law = FogPiece::Law::height;
    piece.profile = {m_extinction, m_scale_height};
    piece.z0 = z, piece.rise = rise;
    piece.colour = m_colour;
    return piece;
  }
  FogPiece below(double t0, double t1) const {
    FogPiece piece;
    piece.t0 = t0, piece.t1 = t1;
    piece.sigma = m_extinction;
    piece.colour = m_colour;
    return piece;
  }
};

}  // namespace

PILEUS_PLUGIN(FogModel, height, ExponentialHeightFog, "thins out exponentially with height")

}  // namespace pileus
