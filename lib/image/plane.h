#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace pileus {

/// One channel in double precision, as the image metrics compute: values[height][width].
struct Plane {
  Plane(int plane_width, int plane_height)
      : width(plane_width), height(plane_height), values(size_t(plane_width) * size_t(plane_height)) {}

  std::span<double> row(int y) { return {values.data() + size_t(y) * size_t(width), size_t(width)}; }
  std::span<const double> row(int y) const {
    return {values.data() + size_t(y) * size_t(width), size_t(width)};
  }

  int width, height;
  std::vector<double> values;
};

/// What a filter sees beyond the border of a plane.
enum class Border {
  replicate,    ///< the nearest value of the plane
  renormalise,  ///< nothing: the weights that fall inside are scaled to sum 1 (kernels without negative
                ///< weights)
};

/// Correlates with the separable kernel kernel_x[i] * kernel_y[j]: result(x, y) is the sum over i and j of
/// kernel_x[i] * kernel_y[j] * plane(x + i - rx, y + j - ry), for kernels of 2 rx + 1 and 2 ry + 1 weights.
Plane filter_separably(const Plane& plane, std::span<const double> kernel_x, std::span<const double> kernel_y,
                       Border border);

/// Weights exp(-x^2 / (2 sigma^2)) for x = -radius to radius, scaled to sum 1.
std::vector<double> gaussian_kernel(double sigma, int radius);

/// The mean of all values: rows are summed one by one, so that it does not depend on threads.
double mean(const Plane& plane);

}  // namespace pileus
