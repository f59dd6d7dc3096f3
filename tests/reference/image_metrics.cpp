#include "tests/reference/image_metrics.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace pileus::reference {
namespace {

constexpr double kPi = 3.14159265358979323846;

double at_nearest(const Plane& plane, int x, int y) {
  return plane.row(std::clamp(y, 0, plane.height - 1))[size_t(std::clamp(x, 0, plane.width - 1))];
}

/// Applies `pixel(x, y)` everywhere.
Plane plane_of(const Plane& like, const std::function<double(int, int)>& pixel) {
  Plane result(like.width, like.height);
  for (int y = 0; y < like.height; ++y) {
    for (int x = 0; x < like.width; ++x) result.row(y)[size_t(x)] = pixel(x, y);
  }
  return result;
}

using Kernel = std::function<double(int, int)>;

/// The sum of the kernel's positive weights, or of its negative ones.
double weight_sum(const Kernel& kernel, int radius, bool positive) {
  double sum = 0.0;
  for (int j = -radius; j <= radius; ++j) {
    for (int i = -radius; i <= radius; ++i) {
      const double weight = kernel(i, j);
      if ((weight > 0.0) == positive) sum += std::abs(weight);
    }
  }
  return sum;
}

/// Correlates with the kernel, its positive weights scaled to sum 1 and its negative ones to sum -1.
Plane correlate(const Plane& plane, int radius, const Kernel& kernel) {
  const double positive = weight_sum(kernel, radius, true), negative = weight_sum(kernel, radius, false);
  return plane_of(plane, [&](int x, int y) {
    double sum = 0.0;
    for (int j = -radius; j <= radius; ++j) {
      for (int i = -radius; i <= radius; ++i) {
        const double weight = kernel(i, j);
        if (weight != 0.0)
          sum += weight / (weight > 0.0 ? positive : negative) * at_nearest(plane, x + i, y + j);
      }
    }
    return sum;
  });
}

struct Xyz {
  double x, y, z;  // relative to white
};

// One row of the sRGB matrix per coordinate, each divided by its sum, which is that coordinate of white.
constexpr double kX[3] = {10135552, 8788810, 4435075};
constexpr double kY[3] = {2613072, 8788810, 887015};
constexpr double kZ[3] = {1425312, 8788810, 70074185};

double weighted(const double (&weights)[3], double r, double g, double b) {
  return (weights[0] * r + weights[1] * g + weights[2] * b) / (weights[0] + weights[1] + weights[2]);
}

Xyz xyz_of(double r, double g, double b) {
  return {weighted(kX, r, g, b), weighted(kY, r, g, b), weighted(kZ, r, g, b)};
}

double determinant(const double (&a)[3], const double (&b)[3], const double (&c)[3]) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/// Solves xyz_of(r, g, b) = xyz for r, g and b by Cramer's rule; clamps them to [0, 1].
Xyz clamped(const Xyz& xyz) {
  const double right[3] = {xyz.x * (kX[0] + kX[1] + kX[2]), xyz.y * (kY[0] + kY[1] + kY[2]),
                           xyz.z * (kZ[0] + kZ[1] + kZ[2])};
  double rgb[3];
  for (int i = 0; i < 3; ++i) {
    double rows[3][3];
    for (int j = 0; j < 3; ++j) {
      rows[0][j] = j == i ? right[0] : kX[j];
      rows[1][j] = j == i ? right[1] : kY[j];
      rows[2][j] = j == i ? right[2] : kZ[j];
    }
    rgb[i] = std::clamp(determinant(rows[0], rows[1], rows[2]) / determinant(kX, kY, kZ), 0.0, 1.0);
  }
  return xyz_of(rgb[0], rgb[1], rgb[2]);
}

struct Lab {
  double l, a, b;
};

Lab hunt_lab(const Xyz& xyz) {
  const auto f = [](double t) {
    return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0;
  };
  const double l = 116.0 * f(xyz.y) - 16.0;
  return {l, 0.01 * l * 500.0 * (f(xyz.x) - f(xyz.y)), 0.01 * l * 200.0 * (f(xyz.y) - f(xyz.z))};
}

double distance(const Lab& p, const Lab& q) {
  const double hyab = std::abs(p.l - q.l) + std::sqrt(std::pow(p.a - q.a, 2.0) + std::pow(p.b - q.b, 2.0));
  return std::pow(hyab, 0.7);
}

struct Opponent {
  Plane y, cx, cz;
};

Opponent opponent_of(const RgbPlanes& rgb) {
  Opponent result{rgb[0], rgb[0], rgb[0]};
  for (size_t i = 0; i < rgb[0].values.size(); ++i) {
    const Xyz xyz = xyz_of(rgb[0].values[i], rgb[1].values[i], rgb[2].values[i]);
    result.y.values[i] = 116.0 * xyz.y - 16.0;
    result.cx.values[i] = 500.0 * (xyz.x - xyz.y);
    result.cz.values[i] = 200.0 * (xyz.y - xyz.z);
  }
  return result;
}

Opponent blurred(const Opponent& planes, double ppd) {
  const int radius = int(std::ceil(3.0 * std::sqrt(0.04 / (2.0 * kPi * kPi)) * ppd));
  const auto csf = [&](double a1, double b1, double a2, double b2) -> Kernel {
    return [=](int x, int y) {
      const double r2 = (x * x + y * y) / (ppd * ppd);
      return a1 * std::sqrt(kPi / b1) * std::exp(-kPi * kPi * r2 / b1) +
             a2 * std::sqrt(kPi / b2) * std::exp(-kPi * kPi * r2 / b2);
    };
  };
  return {correlate(planes.y, radius, csf(1.0, 0.0047, 0.0, 1e-5)),
          correlate(planes.cx, radius, csf(1.0, 0.0053, 0.0, 1e-5)),
          correlate(planes.cz, radius, csf(34.1, 0.04, 13.5, 0.025))};
}

Lab lab_at(const Opponent& planes, size_t i) {
  const double y = (planes.y.values[i] + 16.0) / 116.0;
  return hunt_lab(clamped({y + planes.cx.values[i] / 500.0, y, y - planes.cz.values[i] / 200.0}));
}

/// The lengths of the responses along x and y to the first or the second derivative of a Gaussian.
Plane features(const Opponent& planes, double ppd, bool edges) {
  Plane luminance = planes.y;
  for (double& value : luminance.values) value = (value + 16.0) / 116.0;
  const double sigma = 0.5 * 0.082 * ppd;
  const auto kernel = [&](int x, int y) {
    const double g = std::exp(-(x * x + y * y) / (2.0 * sigma * sigma));
    return edges ? -x * g : (x * x / (sigma * sigma) - 1.0) * g;
  };
  const int radius = int(std::ceil(3.0 * sigma));
  const Plane along_x = correlate(luminance, radius, kernel);
  const Plane along_y = correlate(luminance, radius, [&](int x, int y) { return kernel(y, x); });
  return plane_of(luminance, [&](int x, int y) {
    return std::hypot(along_x.row(y)[size_t(x)], along_y.row(y)[size_t(x)]);
  });
}

}  // namespace

double ssim(const Plane& test, const Plane& reference) {
  const Plane map = plane_of(test, [&](int x, int y) {
    double weight_total = 0, mx = 0, my = 0, vx = 0, vy = 0, covariance = 0;
    const auto for_window = [&](const std::function<void(double, double, double)>& body) {
      for (int j = std::max(0, y - 5); j <= std::min(test.height - 1, y + 5); ++j) {
        for (int i = std::max(0, x - 5); i <= std::min(test.width - 1, x + 5); ++i) {
          const double w = std::exp(-((i - x) * (i - x) + (j - y) * (j - y)) / (2.0 * 1.5 * 1.5));
          body(w, test.row(j)[size_t(i)], reference.row(j)[size_t(i)]);
        }
      }
    };
    for_window([&](double w, double a, double b) {
      weight_total += w;
      mx += w * a;
      my += w * b;
    });
    mx /= weight_total;
    my /= weight_total;
    for_window([&](double w, double a, double b) {
      vx += w / weight_total * (a - mx) * (a - mx);
      vy += w / weight_total * (b - my) * (b - my);
      covariance += w / weight_total * (a - mx) * (b - my);
    });
    const double c1 = 0.0001, c2 = 0.0009;
    return (2 * mx * my + c1) * (2 * covariance + c2) / ((mx * mx + my * my + c1) * (vx + vy + c2));
  });
  double sum = 0.0;
  for (const double value : map.values) sum += value;
  return sum / double(map.values.size());
}

Plane flip_map(const RgbPlanes& test, const RgbPlanes& reference, double pixels_per_degree) {
  const Opponent p = opponent_of(test), q = opponent_of(reference);
  const Opponent p_blurred = blurred(p, pixels_per_degree), q_blurred = blurred(q, pixels_per_degree);
  const Plane p_edges = features(p, pixels_per_degree, true), q_edges = features(q, pixels_per_degree, true);
  const Plane p_points = features(p, pixels_per_degree, false),
              q_points = features(q, pixels_per_degree, false);
  const double largest = distance(hunt_lab(xyz_of(0, 1, 0)), hunt_lab(xyz_of(0, 0, 1)));

  Plane result(test[0].width, test[0].height);
  for (size_t i = 0; i < result.values.size(); ++i) {
    const double d = distance(lab_at(p_blurred, i), lab_at(q_blurred, i)) / largest;
    const double colour = d < 0.4 ? 0.95 / 0.4 * d : 0.95 + (d - 0.4) / 0.6 * 0.05;
    const double edge = std::abs(p_edges.values[i] - q_edges.values[i]);
    const double point = std::abs(p_points.values[i] - q_points.values[i]);
    const double feature = std::sqrt(std::max(edge, point) / std::sqrt(2.0));
    result.values[i] = std::pow(colour, 1.0 - feature);
  }
  return result;
}

}  // namespace pileus::reference
