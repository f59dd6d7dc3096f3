/// A flat, homogeneous layer of fog lit by the sun from above.
///
///   form         "exact" or "legacy"                                 default exact
///   base         height of its bottom                     [m]        default 0
///   thickness    H                                        [m]        >= 0, default 100
///   extinction   B                                        [1/m]      >= 0, default 0.005
///   albedo       share of the extinction that scatters    [1]        0 .. 1, default 1 per channel
///   phase        how scattered light is spread            default isotropic
///   sun          name of the light that shines on it      required
///
///   [fog.morning]
///   type = "sunlit_layer"
///   thickness = 80
///   extinction = 0.004
///   sun = "sun"
///   phase = { type = "hg", g = 0.5 }
///
/// Where the sun stands at an elevation of sine b, a path of the length s that begins in the depth D below
/// the top and climbs by r per metre shows
///
///   I_c S s exp(-min(ta, tb)) phi1(|tb - ta|),   ta = B D / b,  tb = B (D - s r) / b + B s
///
/// with I_c the irradiance of the sun and S = albedo B p(theta): exact for a single scattering. The legacy
/// form dims the sun everywhere as on the ground: I_c S exp(-B H / b) (1 - exp(-B s)) / B, far too little in
/// dense fog. Nothing but the layer itself shades it, and it shades nothing. Flat: not for a sun below 5
/// degrees or paths beyond 50 km. ref: METHODS 2.3; docs/fog.md
#include <algorithm>

#include "lib/core/param_table.h"
#include "lib/math/transmittance.h"
#include "lib/scene/fog_model.h"
#include "lib/scene/phase_function.h"

namespace pileus {
namespace {

struct SunlitLayer final : FogModel {
  std::string m_form = "exact", m_sun;
  double m_base = 0.0, m_thickness = 100.0, m_extinction = 0.005;
  Rgb m_albedo{1.0, 1.0, 1.0};
  std::shared_ptr<const PhaseFunction> m_phase;

  void describe(ParamTable& params) override {
    params.text("form", m_form, "how the sun is dimmed on its way into the layer")
        .one_of({"exact", "legacy"});
    params.number("base", m_base, "m", "height of its bottom");
    params.number("thickness", m_thickness, "m", "of the layer").at_least(0);
    params.number("extinction", m_extinction, "1/m", "of the fog").at_least(0);
    params.rgb("albedo", m_albedo, "1", "share of the extinction that is scattering").at_least(0).at_most(1);
    params.plugin<PhaseFunction>("phase", m_phase, "isotropic",
                                 "how scattered light is spread over directions");
    params.reference("sun", m_sun, Light::kKind, "the light that shines on it").required();
  }
  bool is_visible() const override { return m_extinction > 0.0 && m_thickness > 0.0; }
  std::string sun_name() const override { return m_sun; }

  void append_pieces(const Ray& ray, const FogView& view, std::vector<FogPiece>& pieces) const override {
    const double z = ray.o.y - m_base, rise = ray.d.y;
    FogPiece piece;
    if (rise != 0.0) {
      const double bottom = -z / rise, top = (m_thickness - z) / rise;
      piece.t0 = std::max(std::min(bottom, top), 0.0);
      piece.t1 = std::max(bottom, top);
    } else if (!(z > 0.0 && z < m_thickness)) {
      return;
    }
    if (!(piece.t0 < piece.t1)) return;
    piece.sigma = m_extinction;
    light(ray, view.sun, std::clamp(m_thickness - (z + piece.t0 * rise), 0.0, m_thickness), piece);
    pieces.push_back(piece);
  }

 private:
  void light(const Ray& ray, const Illumination& sun, double depth, FogPiece& piece) const {
    const double elevation = sun.wi.y;
    if (!(elevation > 0.0)) return;  // a sun below the horizon
    piece.colour = sun.irradiance * m_albedo * m_phase->p(-ray.d, sun.wi);
    if (m_form == "legacy") {
      piece.colour *= transmittance(m_extinction * m_thickness / elevation);
    } else {
      piece.source = FogPiece::Source::sunlit;
      piece.sun_depth = m_extinction * depth / elevation;
      piece.sun_slope = -m_extinction * ray.d.y / elevation;
    }
  }
};

}  // namespace

PILEUS_PLUGIN(FogModel, sunlit_layer, SunlitLayer, "a flat layer lit by the sun from above")

}  // namespace pileus
