#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "lib/image/image.h"
#include "lib/scene/effect_plan.h"
#include "lib/scene/integrator.h"

namespace pileus {

/// Collects ray results into the planes of a picture. Tiles write different pixels, so no lock is needed.
class Film {
 public:
  /// Planes for the plan's AOVs. `pixel_rays` rays are averaged per pixel.
  Film(int width, int height, int pixel_rays, const EffectPlan& plan);

  /// Sets pixel (x, y) from its rays.
  void set_pixel(int x, int y, std::span<const RayResult> rays);

  /// Sets the pixels [lo, hi) as if all of their rays had this result.
  void fill(const Vec2i& lo, const Vec2i& hi, const RayResult& all);

  /// Largest and mean of the error estimates; none where the integrator gives none.
  std::optional<double> max_error() const;
  std::optional<double> mean_error() const;

  /// Largest and mean of the error bounds; none unless every pixel has one.
  std::optional<double> max_bound() const;
  std::optional<double> mean_bound() const;

  /// The error estimates, one per pixel: a checkpoint keeps them, so that a resumed render reports all of
  /// them.
  std::vector<float>& errors() { return m_errors; }
  const std::vector<float>& errors() const { return m_errors; }

  Image& image() { return m_image; }
  const Image& image() const { return m_image; }

 private:
  RayResult mean(std::span<const RayResult> rays) const;
  void set_pixel(int x, int y, const RayResult& result);
  void set(int channel, size_t pixel, double value) {
    if (channel >= 0) m_image.channels[size_t(channel)].values[pixel] = float(value);
  }
  int add_if(bool wanted, const char* name);

  Image m_image;
  std::vector<float> m_errors;  ///< error estimate per pixel
  double m_weight;
  bool m_has_aovs = false;  ///< besides colour and alpha
  int m_red, m_green, m_blue, m_alpha, m_transmittance, m_z, m_z_half, m_samples, m_error,
      m_bound;  ///< channel or -1
};

}  // namespace pileus
