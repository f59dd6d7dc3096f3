/// Colours by height or by slope: meadows, rock and snow on a terrain.
///
///   of           height (default): y in the texture's space; slope: the angle of the surface to the
///   horizontal stops        where which colour begins: `at` in units of the texture's space (metres, where
///   it is not
///                scaled), or in degrees, 0 .. 90
///   wobble       noise that moves the borders: amplitude [as stops], frequency [1/unit], octaves, seed
///   steep        slopes that show a colour of their own instead: from_deg, to_deg, color; blended between
///   scale, rotate_deg, translate   where it is put
///
///   [texture.land]
///   type   = "ramp"
///   of     = "height"
///   stops  = [{ at = 300, color = [0.08, 0.12, 0.03] }, { at = 420, color = [0.25, 0.22, 0.2] },
///             { at = 560, color = [0.85, 0.88, 0.92] }]
///   steep  = { from_deg = 32, to_deg = 40, color = [0.2, 0.18, 0.16] }
///   wobble = { amplitude = 40, frequency = 0.01 }
///
/// Heights are averaged exactly over what a pixel sees; slopes are those of the surface's normal.
#include <numbers>

#include <fmt/format.h>

#include "lib/texture/color_stops.h"
#include "shaders_cpu/texture/octave_filter.h"

namespace pileus {
namespace {

/// The angle between a surface and the horizontal, 0 .. 90 degrees, whichever side the normal is on.
double slope_deg(const Vec3d& n) {
  return std::atan2(std::hypot(n.x, n.z), std::fabs(n.y)) * (180.0 * std::numbers::inv_pi);
}

struct Ramp final : Texture {
  std::string m_of = "height";
  ColorStops m_stops;
  double m_wobble = 0.0;
  FbmParams m_wobble_params{.octaves = 4};
  double m_steep_from = 90.0, m_steep_to = 90.0;
  Rgb m_steep_color{0.2, 0.18, 0.16};
  FilteredNoise m_noise;

  void describe_pattern(ParamTable& params) override {
    params.text("of", m_of, "what the colours follow").one_of({"height", "slope"});
    m_stops.describe(params, "1", "colours along the height or the slope [deg]").required();
    params.group(
        "wobble",
        [this](ParamTable& group) {
          group.number("amplitude", m_wobble, "1", "how far borders move at most, in units of the stops")
              .at_least(0);
          group.number("frequency", m_wobble_params.frequency, "1", "cells per unit of the texture")
              .above(0)
              .at_most(1e6);
          group.integer("octaves", m_wobble_params.octaves, "how many sizes of wobbles")
              .at_least(1)
              .at_most(16);
          group.integer("seed", m_wobble_params.seed, "another seed is another noise").at_least(0);
        },
        "noise that moves the borders");
    params.group(
        "steep",
        [this](ParamTable& group) {
          group.number("from_deg", m_steep_from, "deg", "slope at which its colour begins to show")
              .at_least(0)
              .at_most(90);
          group.number("to_deg", m_steep_to, "deg", "slope from which on nothing else shows")
              .at_least(0)
              .at_most(90);
          group.rgb("color", m_steep_color, "1", "of steep parts").at_least(0).at_most(1);
        },
        "slopes that show a colour of their own");
  }

  void commit_pattern(std::vector<std::string>& problems) override {
    m_stops.check(problems);
    if (m_steep_from > m_steep_to) {
      problems.push_back(fmt::format("steep: from_deg = {} and to_deg = {}; expected from_deg <= to_deg",
                                     m_steep_from, m_steep_to));
    }
    m_noise = FilteredNoise(m_wobble_params);
  }

  TextureValue pattern(const TexturedPoint& point) const override {
    const double slope = slope_deg(point.n);
    const double shift = m_wobble > 0.0 ? m_wobble * m_noise.value(point.p, footprint_width(point)) : 0.0;
    const double height = point.p.y + shift;
    const double reach = 0.5 * (std::fabs(point.a.y) + std::fabs(point.b.y));
    const Rgb color =
        m_of == "slope" ? m_stops.at(slope + shift) : m_stops.mean({height - reach, height + reach});
    if (!(slope > m_steep_from)) return {color, 1.0};
    const double share = slope < m_steep_to ? (slope - m_steep_from) / (m_steep_to - m_steep_from) : 1.0;
    return {m_steep_color * share + color * (1.0 - share), 1.0};
  }
};

}  // namespace

PILEUS_PLUGIN(Texture, ramp, Ramp, "colours by height or by slope")

}  // namespace pileus
