/// Fog by distance from the camera: what lies at the distance d shows F(d) of its colour, and 1 - F(d) of the
/// fog's.
///
///   law       "linear"                F = (end - d) / (end - start), within 0 .. 1
///             "exponential"           F = exp(-density (d - start))            the default
///             "exponential_squared"   F = exp(-(density (d - start))^2)
///   measure   "radial": d is the distance from the camera; "planar": its part along the view axis, cheaper
///   in
///             former times, but things come out of the fog as the camera turns    default radial
///   start     where the fog begins                  [m]           >= 0, default 0
///   end       where nothing shows any more; linear  [m]           >= start, default 1000
///   density   of the exponential laws               [1/m]         >= 0, default 0.001
///   colour    of the fog where it is opaque         [W/(m2 sr)]   >= 0, default [0.6, 0.7, 0.8]
///   per       "pixel": the law at every point; "table": linear between 256 distances, F within 2e-4;
///   "vertex": at
///             the corners of tiles of 16 pixels, bilinear between them, wrong where distances jump. The
///             latter two hold where there is no other fog                                       default
///             pixel
///
///   [fog.haze]
///   type = "distance"
///   density = 0.0004
///   colour = [0.55, 0.66, 0.8]
///
/// Only the exponential law is that of a medium; the others change with the place of the camera.
/// ref: METHODS 2.1; docs/fog.md
#include "lib/core/param_table.h"
#include "lib/scene/fading_fog.h"

namespace pileus {
namespace {

struct DistanceFog final : FadingFog {
  std::string m_law = "exponential", m_measure = "radial", m_per = "pixel";

  DistanceFog() { fading.colour = Rgb(0.6, 0.7, 0.8); }

  void describe(ParamTable& params) override {
    params.text("law", m_law, "how much shows at a distance")
        .one_of({"linear", "exponential", "exponential_squared"});
    params.text("measure", m_measure, "distance from the camera, or along its view axis")
        .one_of({"radial", "planar"});
    params.number("start", fading.start, "m", "distance at which the fog begins").at_least(0);
    params.number("end", fading.end, "m", "distance at which nothing shows any more (linear)").at_least(0);
    params.number("density", fading.density, "1/m", "of the exponential laws").at_least(0);
    params.rgb("colour", fading.colour, "W/(m2 sr)", "radiance of the fog where it is opaque").at_least(0);
    params.text("per", m_per, "where the law is evaluated, if there is no other fog")
        .one_of({"pixel", "table", "vertex"});
  }
  void commit(std::vector<std::string>& problems) override {
    fading.is_planar = m_measure == "planar";
    fading.law = m_law == "linear"        ? Fading::Law::linear
                 : m_law == "exponential" ? Fading::Law::exponential
                                          : Fading::Law::exponential_squared;
    fading.per = m_per == "table"    ? Fading::Per::table
                 : m_per == "vertex" ? Fading::Per::vertex
                                     : Fading::Per::pixel;
    if (m_law == "linear" && fading.end < fading.start) {
      problems.emplace_back("end must not lie before start");
    } else {
      fading.prepare();
    }
  }
  bool is_visible() const override { return fading.law == Fading::Law::linear || fading.density > 0.0; }

  void append_pieces(const Ray& ray, const FogView& view, std::vector<FogPiece>& pieces) const override {
    const double per_metre = fading.is_planar ? dot(ray.d, view.axis) : 1.0;
    if (!(per_metre > 0.0)) return;
    FogPiece piece;
    piece.t0 = fading.start / per_metre;
    piece.colour = fading.colour;
    if (fading.law == Fading::Law::linear) {
      piece.law = FogPiece::Law::fade;
      piece.length = (fading.end - fading.start) / per_metre;
    } else if (fading.law == Fading::Law::exponential) {
      piece.sigma = fading.density * per_metre;
    } else {
      const double density = fading.density * per_metre;
      piece.law = FogPiece::Law::linear;
      piece.slope = 2.0 * density * density;
    }
    pieces.push_back(piece);
  }
};

}  // namespace

PILEUS_PLUGIN(FogModel, distance, DistanceFog, "linear or exponential fading with distance")

}  // namespace pileus
