#include "pileus/film.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lib/core/build_features.h"
#include "lib/core/parallel.h"

namespace pileus {

namespace {

/// A bound of a pixel's error once its channels are floats, as a float that is not below it.
double bound_in_floats(double bound, const Rgb& radiance) {
  if (bound == 0.0 && radiance == Rgb(Vec3f(radiance))) return 0.0;
  const double brightest = std::max({std::abs(radiance.x), std::abs(radiance.y), std::abs(radiance.z)});
  const float rounded = float(bound + 0x1p-24 * brightest);
  return double(std::nextafter(rounded, std::numeric_limits<float>::infinity()));
}

}  // namespace

Film::Film(int width, int height, int pixel_rays, const EffectPlan& plan) : m_weight(1.0 / pixel_rays) {
  m_image.width = width;
  m_image.height = height;
  const auto wants = [&](const char* aov) { return plan.aovs.count(aov) > 0; };
  m_red = add_if(wants("beauty"), "R");
  m_green = add_if(wants("beauty"), "G");
  m_blue = add_if(wants("beauty"), "B");
  m_alpha = add_if(wants("beauty"), "A");
  m_transmittance = add_if(wants("transmittance"), "transmittance");
  m_z = add_if(wants("Z"), "Z");
  m_z_half = add_if(wants("Z"), "Z_half");
  m_samples = add_if(wants("samples"), "samples");
  m_error = add_if(wants("error_estimate"), "error_estimate");
  m_bound = add_if(wants("error_bound"), "error_bound");
  m_has_aovs = plan.aovs.size() > plan.aovs.count("beauty");
  // All planes at once: what takes its time is that the system has to find the memory.
  const size_t planes = m_image.channels.size();
  parallel_for(planes + 1, [&](size_t i) {
    (i < planes ? m_image.channels[i].values : m_errors).assign(m_image.pixel_count(), 0.0f);
  });
}

int Film::add_if(bool wanted, const char* name) {
  if (!wanted) return -1;
  m_image.channels.push_back({name, {}});
  return int(m_image.channels.size()) - 1;
}

RayResult Film::mean(std::span<const RayResult> rays) const {
  RayResult mean;
  mean.transmittance = mean.error = mean.bound = 0.0;
  for (const RayResult& ray : rays) {
    mean.radiance += m_weight * ray.radiance;
    mean.transmittance += m_weight * ray.transmittance;
    mean.error += m_weight * ray.error;
    mean.bound += m_weight * ray.bound;
    mean.samples += ray.samples;
    mean.z_first = std::min(mean.z_first, ray.z_first);
    mean.z_half = std::min(mean.z_half, ray.z_half);
  }
  return mean;
}

void Film::set_pixel(int x, int y, std::span<const RayResult> rays) {
  set_pixel(x, y, rays.size() == 1 ? rays.front() : mean(rays));
}

void Film::fill(const Vec2i& lo, const Vec2i& hi, const RayResult& all) {
  const std::vector<RayResult> rays(size_t(std::lround(1.0 / m_weight)), all);
  const RayResult pixel = rays.size() == 1 ? all : mean(rays);
  for (int y = lo.y; y < hi.y; ++y) {
    for (int x = lo.x; x < hi.x; ++x) set_pixel(x, y, pixel);
  }
}

void Film::set_pixel(int x, int y, const RayResult& result) {
  const size_t pixel = size_t(y) * size_t(m_image.width) + size_t(x);
  set(m_red, pixel, result.radiance.x);
  set(m_green, pixel, result.radiance.y);
  set(m_blue, pixel, result.radiance.z);
  set(m_alpha, pixel, 1.0 - result.transmittance);
  if (kHasAovs && m_has_aovs) {
    set(m_transmittance, pixel, result.transmittance);
    set(m_z, pixel, result.z_first);
    set(m_z_half, pixel, result.z_half);
    set(m_samples, pixel, double(result.samples));
    set(m_error, pixel, result.error);
    if (m_bound >= 0) set(m_bound, pixel, bound_in_floats(result.bound, result.radiance));
  }
  m_errors[pixel] = float(result.error);
}

std::optional<double> Film::max_error() const {
  std::optional<double> largest;
  for (const float error : m_errors) {
    if (!std::isnan(error)) largest = std::max(largest.value_or(0.0), double(error));
  }
  return largest;
}

std::optional<double> Film::mean_error() const {
  double sum = 0.0;
  size_t count = 0;
  for (const float error : m_errors) {
    if (std::isnan(error)) continue;
    sum += double(error);
    ++count;
  }
  return count > 0 ? std::optional<double>(sum / double(count)) : std::nullopt;
}

std::optional<double> Film::max_bound() const {
  if (m_bound < 0) return std::nullopt;
  double largest = 0.0;
  for (const float bound : m_image.channels[size_t(m_bound)].values) {
    if (std::isnan(bound)) return std::nullopt;
    largest = std::max(largest, double(bound));
  }
  return largest;
}

std::optional<double> Film::mean_bound() const {
  if (m_bound < 0) return std::nullopt;
  const std::vector<float>& bounds = m_image.channels[size_t(m_bound)].values;
  double sum = 0.0;
  for (const float bound : bounds) sum += double(bound);
  return std::isnan(sum) ? std::nullopt : std::optional<double>(sum / double(bounds.size()));
}

}  // namespace pileus
