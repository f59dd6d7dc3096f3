/// A layer of cloud: an ellipsoid with an extinction and a colour that change from its bottom to its top.
/// Several, one in the other or one over the other, make a cloud of layers.
///
///   form              "exact" or "legacy"                            default exact
///   center            of the ellipsoid                 [m]           default [0, 0, 0]
///   radii             half axes along x, y and z       [m]           > 0, default [1, 1, 1]
///   extinction        at the bottom                    [1/m]         >= 0, default 0.1
///   extinction_top    at the top                       [1/m]         >= 0, default 0.1
///   colour            at the bottom                    [W/(m2 sr)]   >= 0, default [0.6, 0.65, 0.7]
///   colour_top        at the top                       [W/(m2 sr)]   >= 0, default [0.9, 0.9, 0.9]
///
///   [fog.cloud]
///   type = "layer"
///   center = [0, 900, -2000]
///   radii = [700, 120, 500]
///   extinction = 0.004
///
/// The extinction is linear in height, so that the optical depth of a path of the length d is (a0 + a1) d /
/// 2, from its values at both ends. The colour is linear in the optical depth from the bottom up; where the
/// extinction does not change that is linear in height. The apparent colour of what lies behind then is,
/// exactly and in any direction,
///
///   T * behind + w0 c0 + w1 c1,   T = exp(-tau),  w0 = 1 - (1 - T) / tau,  w1 = (1 - T) / tau - T
///
/// with c0 and c1 the colours at the near and the far end of the path. The legacy form takes half of their
/// sum for all of the path, (c0 + c1) (1 - T) / 2: too much of the far end's colour where the layer is thick,
/// and not the same when a path is cut in two. ref: METHODS 2.2; docs/fog.md
#include <algorithm>

#include "lib/core/param_table.h"
#include "lib/math/roots.h"
#include "lib/scene/fog_model.h"

namespace pileus {
namespace {

struct LayerFog final : FogModel {
  std::string m_form = "exact";
  Vec3d m_center{0.0, 0.0, 0.0}, m_radii{1.0, 1.0, 1.0};
  double m_extinction = 0.1, m_extinction_top = 0.1;
  Rgb m_colour{0.6, 0.65, 0.7}, m_colour_top{0.9, 0.9, 0.9};

  void describe(ParamTable& params) override {
    params.text("form", m_form, "how the colours of both ends of a path are mixed")
        .one_of({"exact", "legacy"});
    params.vector("center", m_center, "m", "centre of the ellipsoid");
    params.vector("radii", m_radii, "m", "half axes along x, y and z").above(0);
    params.number("extinction", m_extinction, "1/m", "at the bottom").at_least(0);
    params.number("extinction_top", m_extinction_top, "1/m", "at the top").at_least(0);
    params.rgb("colour", m_colour, "W/(m2 sr)", "radiance where it is opaque, at the bottom").at_least(0);
    params.rgb("colour_top", m_colour_top, "W/(m2 sr)", "the same at the top").at_least(0);
  }
  bool is_visible() const override { return m_extinction > 0.0 || m_extinction_top > 0.0; }

  void append_pieces(const Ray& ray, const FogView&, std::vector<FogPiece>& pieces) const override {
    const Vec3d o = (ray.o - m_center) / m_radii, d = ray.d / m_radii;
    const double scale = length(d);
    const Roots<double> hits = sphere_hits(o, d / scale, 1.0);
    if (hits.count < 2) return;
    FogPiece piece;
    piece.t0 = std::max(hits.t[0] / scale, 0.0);
    piece.t1 = hits.t[1] / scale;
    if (!(piece.t0 < piece.t1)) return;
    // u: share of the height, 0 at the bottom and 1 at the top.
    const double u = std::clamp(0.5 + 0.5 * (o.y + piece.t0 * d.y), 0.0, 1.0), climb = 0.5 * d.y;
    const double change = m_extinction_top - m_extinction;
    piece.sigma = m_extinction + change * u;
    piece.slope = change * climb;
    piece.law = piece.slope == 0.0 ? FogPiece::Law::constant : FogPiece::Law::linear;
    piece.source = m_form == "legacy" ? FogPiece::Source::mean : FogPiece::Source::plain;
    const double share = (m_extinction + 0.5 * change * u) * u, whole = m_extinction + 0.5 * change;
    piece.colour = m_colour + (m_colour_top - m_colour) * (share / whole);
    piece.colour_slope = (m_colour_top - m_colour) * (climb / whole);
    pieces.push_back(piece);
  }
};

}  // namespace

PILEUS_PLUGIN(FogModel, layer, LayerFog, "a layer of cloud: an ellipsoid with a colour from bottom to top")

}  // namespace pileus
