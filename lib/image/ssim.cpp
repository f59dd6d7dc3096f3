#include "lib/image/ssim.h"

#include "lib/core/error.h"

namespace pileus {
namespace {

Plane product(const Plane& a, const Plane& b) {
  Plane result(a.width, a.height);
  for (size_t i = 0; i < a.values.size(); ++i) result.values[i] = a.values[i] * b.values[i];
  return result;
}

}  // namespace

double ssim(const Plane& test, const Plane& reference) {
  PILEUS_CHECK(test.width == reference.width && test.height == reference.height);
  constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;  // (K L)^2 with the dynamic range L = 1

  // The windows' means of x, y, x^2, y^2 and x y give their means, variances and covariance.
  const std::vector<double> window = gaussian_kernel(1.5, 5);
  const auto windowed = [&](const Plane& plane) {
    return filter_separably(plane, window, window, Border::renormalise);
  };
  const Plane mean_x = windowed(test), mean_y = windowed(reference);
  const Plane mean_xx = windowed(product(test, test)), mean_yy = windowed(product(reference, reference));
  const Plane mean_xy = windowed(product(test, reference));

  Plane map(test.width, test.height);
  for (size_t i = 0; i < map.values.size(); ++i) {
    const double mx = mean_x.values[i], my = mean_y.values[i];
    const double variances = (mean_xx.values[i] - mx * mx) + (mean_yy.values[i] - my * my);
    const double covariance = mean_xy.values[i] - mx * my;
    map.values[i] =
        (2.0 * mx * my + kC1) * (2.0 * covariance + kC2) / ((mx * mx + my * my + kC1) * (variances + kC2));
  }
  return mean(map);
}

}  // namespace pileus
