/// A chequered board, averaged exactly over what a pixel sees of it.
///
///   color_a, color_b   of the squares; default white and black
///   projection   planar (default), spherical or cylindrical
///   tiles_u, tiles_v   squares from left to right and from top to bottom; default 8. Around an axis, even
///                numbers join without a seam
///   scale, rotate_deg, translate   where it is put; before that it is the unit square, as an image is
///
///   [texture.board]
///   type = "checker"
///   scale = [8, 1, 8]         # squares of 1 m
///
/// It goes on without end beyond its borders.
#include <algorithm>
#include <cmath>

#include "shaders_cpu/texture/laid_out.h"

namespace pileus {
namespace {

/// The mean of the wave that is 1 from 0 to 1, -1 from 1 to 2 and so on, over an interval around x.
double mean_of_wave(double x, double width) {
  const auto phase = [](double at) { return at - 2.0 * std::floor(0.5 * at); };
  if (!(width > 1e-9)) return phase(x) < 1.0 ? 1.0 : -1.0;
  // Its integral goes up and down.
  const auto integral = [&](double at) { return 1.0 - std::fabs(1.0 - phase(at)); };
  return std::clamp((integral(x + 0.5 * width) - integral(x - 0.5 * width)) / width, -1.0, 1.0);
}

struct Checker final : Texture {
  Rgb m_color_a{1.0, 1.0, 1.0}, m_color_b{0.0, 0.0, 0.0};
  Layout m_layout{.tiles_u = 8.0, .tiles_v = 8.0};
  Projection m_projection = Projection::planar;

  void describe_pattern(ParamTable& params) override {
    params.rgb("color_a", m_color_a, "1", "of the first square and every other one").at_least(0).at_most(1);
    params.rgb("color_b", m_color_b, "1", "of the squares between").at_least(0).at_most(1);
    m_layout.describe(params);
  }
  void commit_pattern(std::vector<std::string>&) override { m_projection = m_layout.projection(); }

  TextureValue pattern(const TexturedPoint& point) const override {
    const double share = m_layout.mean(m_projection, point, [](const Layout::Place& place) {
      const auto& [uv, area] = place;
      const double width_u = std::fabs(area.a.x) + std::fabs(area.b.x);
      const double width_v = std::fabs(area.a.y) + std::fabs(area.b.y);
      return 0.5 + 0.5 * mean_of_wave(uv.x, width_u) * mean_of_wave(uv.y, width_v);
    });
    return {m_color_a * share + m_color_b * (1.0 - share), 1.0};
  }
};

}  // namespace

PILEUS_PLUGIN(Texture, checker, Checker, "a chequered board")

}  // namespace pileus
