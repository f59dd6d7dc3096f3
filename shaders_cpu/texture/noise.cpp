/// Noise in space, as colours: wood, stone, dirt, whatever the stops make of it.
///
///   kind         fbm (default), billow or ridged; docs/noise.md
///   octaves      default 6
///   frequency    of the first octave, in cells per unit of the texture; default 1
///   lacunarity, gain   from one octave to the next; default 2 and 0.5
///   seed         default 0
///   stops        colours along the noise, 0 .. 1; default black at 0, white at 1
///   scale, rotate_deg, translate   where it is put, and how large its unit is
///
///   [texture.marble]
///   type = "noise"
///   kind = "ridged"
///   stops = [{ at = 0.4, color = [0.8, 0.8, 0.75] }, { at = 0.9, color = [0.2, 0.2, 0.25] }]
///
/// The value is 1/2 + s for fbm and s for the others, where s is the sum of the octaves. Octaves that are
/// finer than what a pixel sees fade into their mean.
#include "lib/texture/color_stops.h"
#include "shaders_cpu/texture/octave_filter.h"

namespace pileus {
namespace {

struct NoiseTexture final : Texture {
  std::string m_kind = "fbm";
  FbmParams m_params;
  ColorStops m_stops{{{0.0, Rgb(0.0)}, {1.0, Rgb(1.0)}}};
  FilteredNoise m_noise;

  void describe_pattern(ParamTable& params) override {
    params.text("kind", m_kind, "what each octave adds").one_of({"fbm", "billow", "ridged"});
    params.integer("octaves", m_params.octaves, "how many sizes of features").at_least(1).at_most(16);
    params.number("frequency", m_params.frequency, "1", "cells of the first octave per unit of the texture")
        .above(0)
        .at_most(1e6);
    params.number("lacunarity", m_params.lacunarity, "1", "frequency of an octave over that before")
        .at_least(1)
        .at_most(16);
    params.number("gain", m_params.gain, "1", "amplitude of an octave over that before").above(0).at_most(1);
    params.integer("seed", m_params.seed, "another seed is another noise").at_least(0);
    m_stops.describe(params, "1", "colours along the noise");
  }

  void commit_pattern(std::vector<std::string>& problems) override {
    m_stops.check(problems);
    m_noise = FilteredNoise(m_params, m_kind == "billow"   ? OctaveSum::billow
                                      : m_kind == "ridged" ? OctaveSum::ridged
                                                           : OctaveSum::fbm);
  }

  TextureValue pattern(const TexturedPoint& point) const override {
    const double sum = m_noise.value(point.p, footprint_width(point));
    return {m_stops.at(m_kind == "fbm" ? 0.5 + sum : sum), 1.0};
  }
};

}  // namespace

PILEUS_PLUGIN(Texture, noise, NoiseTexture, "noise in space, as colours")

}  // namespace pileus
