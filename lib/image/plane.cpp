#include "lib/image/plane.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "lib/core/error.h"
#include "lib/core/parallel.h"

namespace pileus {
namespace {

/// What each result is divided by: the sum of the weights that fall inside [0, size), or 1.
std::vector<double> divisors(std::span<const double> kernel, int size, Border border) {
  std::vector<double> result(size_t(size), 1.0);
  if (border == Border::replicate) return result;
  const int radius = int(kernel.size() / 2);
  for (int x = 0; x < size; ++x) {
    const int first = std::max(0, radius - x), last = std::min(2 * radius, radius + size - 1 - x);
    result[size_t(x)] = std::accumulate(kernel.begin() + first, kernel.begin() + last + 1, 0.0);
  }
  return result;
}

/// result += weight * source. The weights are the outer loop, so that this one runs in SIMD lanes.
void accumulate(double weight, const double* source, std::span<double> result) {
  for (size_t x = 0; x < result.size(); ++x) result[x] += weight * source[x];
}

void divide(std::span<double> row, const std::vector<double>& by) {
  for (size_t x = 0; x < row.size(); ++x) row[x] /= by[x];
}

Plane filter_rows(const Plane& plane, std::span<const double> kernel, Border border) {
  const size_t radius = kernel.size() / 2;
  const std::vector<double> divisor = divisors(kernel, plane.width, border);
  Plane result(plane.width, plane.height);
  parallel_for(size_t(plane.height), [&](size_t y) {
    const auto source = plane.row(int(y));
    const bool replicate = border == Border::replicate;
    std::vector<double> padded(source.size() + 2 * radius);
    std::fill_n(padded.begin(), radius, replicate ? source.front() : 0.0);
    std::copy(source.begin(), source.end(), padded.begin() + std::ptrdiff_t(radius));
    std::fill_n(padded.rbegin(), radius, replicate ? source.back() : 0.0);
    const auto row = result.row(int(y));
    for (size_t i = 0; i < kernel.size(); ++i) accumulate(kernel[i], padded.data() + i, row);
    if (!replicate) divide(row, divisor);
  });
  return result;
}

Plane filter_columns(const Plane& plane, std::span<const double> kernel, Border border) {
  const int radius = int(kernel.size() / 2);
  const std::vector<double> divisor = divisors(kernel, plane.height, border);
  Plane result(plane.width, plane.height);
  parallel_for(size_t(plane.height), [&](size_t y) {
    const auto row = result.row(int(y));
    for (int i = 0; i <= 2 * radius; ++i) {
      const int source_y = int(y) + i - radius;
      const int inside_y = std::clamp(source_y, 0, plane.height - 1);
      if (source_y != inside_y && border == Border::renormalise) continue;
      accumulate(kernel[size_t(i)] / divisor[y], plane.row(inside_y).data(), row);
    }
  });
  return result;
}

}  // namespace

Plane filter_separably(const Plane& plane, std::span<const double> kernel_x, std::span<const double> kernel_y,
                       Border border) {
  PILEUS_CHECK(kernel_x.size() % 2 == 1 && kernel_y.size() % 2 == 1);
  return filter_columns(filter_rows(plane, kernel_x, border), kernel_y, border);
}

std::vector<double> gaussian_kernel(double sigma, int radius) {
  std::vector<double> kernel;
  for (int x = -radius; x <= radius; ++x) {
    kernel.push_back(std::exp(-double(x) * double(x) / (2.0 * sigma * sigma)));
  }
  const double sum = std::accumulate(kernel.begin(), kernel.end(), 0.0);
  for (double& weight : kernel) weight /= sum;
  return kernel;
}

double mean(const Plane& plane) {
  double sum = 0.0;
  for (int y = 0; y < plane.height; ++y) {
    const auto row = plane.row(y);
    sum += std::accumulate(row.begin(), row.end(), 0.0);
  }
  return sum / double(plane.values.size());
}

}  // namespace pileus
