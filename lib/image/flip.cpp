#include "lib/image/flip.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "lib/core/error.h"
#include "lib/core/parallel.h"
#include "lib/math/vec.h"

namespace pileus {
namespace {

using std::numbers::pi;

// ---- colour spaces: linear RGB -> XYZ relative to the white -> YCxCz or Hunt-adjusted L*a*b* ----

/// Rows are the contributions of R, G and B to X, Y and Z (sRGB primaries and D65 white), each of X, Y and Z
/// divided by that of white.
Imath::M33d xyz_from_rgb() {
  const Imath::M33d xyz(10135552.0 / 24577794.0, 2613072.0 / 12288897.0, 1425312.0 / 73733382.0,  //
                        8788810.0 / 24577794.0, 8788810.0 / 12288897.0, 8788810.0 / 73733382.0,   //
                        4435075.0 / 24577794.0, 887015.0 / 12288897.0, 70074185.0 / 73733382.0);
  const Vec3d white = Vec3d(1.0) * xyz;
  return xyz * Imath::M33d(1 / white.x, 0, 0, 0, 1 / white.y, 0, 0, 0, 1 / white.z);
}

const Imath::M33d kXyzFromRgb = xyz_from_rgb();
const Imath::M33d kRgbFromXyz = kXyzFromRgb.inverse();

Vec3d ycxcz_from_rgb(const Vec3d& rgb) {
  const Vec3d xyz = rgb * kXyzFromRgb;
  return {116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z)};
}

Vec3d rgb_from_ycxcz(const Vec3d& c) {
  const double y = (c.x + 16.0) / 116.0;
  return Vec3d(y + c.y / 500.0, y, y - c.z / 200.0) * kRgbFromXyz;
}

double lab_curve(double t) {
  constexpr double kDelta = 6.0 / 29.0;
  return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
}

/// L*a*b* whose chroma fades with the luminance, as the eye's does (the Hunt effect).
Vec3d hunt_lab_from_rgb(const Vec3d& rgb) {
  const Vec3d xyz = rgb * kXyzFromRgb;
  const double fx = lab_curve(xyz.x), fy = lab_curve(xyz.y), fz = lab_curve(xyz.z);
  const double lightness = 116.0 * fy - 16.0;
  return {lightness, 0.01 * lightness * 500.0 * (fx - fy), 0.01 * lightness * 200.0 * (fy - fz)};
}

// ---- colour pipeline ----

/// One Gaussian term of a contrast sensitivity: amplitude a, width b [deg^2], table 1 of the paper.
struct CsfTerm {
  double a, b;
};

constexpr CsfTerm kAchromatic[] = {{1.0, 0.0047}};
constexpr CsfTerm kRedGreen[] = {{1.0, 0.0053}};
constexpr CsfTerm kBlueYellow[] = {{34.1, 0.04}, {13.5, 0.025}};
constexpr double kWidestTerm = 0.04;

/// Blurs a plane as the eye does: with sum of a * sqrt(pi / b) * exp(-pi^2 r^2 / b), scaled to sum 1.
Plane contrast_filter(const Plane& plane, std::span<const CsfTerm> terms, double pixels_per_degree) {
  const int radius = int(std::ceil(3.0 * std::sqrt(kWidestTerm / (2.0 * pi * pi)) * pixels_per_degree));
  Plane result(plane.width, plane.height);
  double weight_sum = 0.0;
  for (const CsfTerm& term : terms) {
    const double sigma = std::sqrt(term.b / 2.0) / pi * pixels_per_degree;
    const std::vector<double> kernel = gaussian_kernel(sigma, radius);
    // A kernel of sum 1 has the weight 1 / (its sum unscaled) in the middle, so this is the term's sum in 2D.
    const double middle = kernel[size_t(radius)];
    const double weight = term.a * std::sqrt(pi / term.b) / (middle * middle);
    const Plane blurred = filter_separably(plane, kernel, kernel, Border::replicate);
    for (size_t i = 0; i < result.values.size(); ++i) result.values[i] += weight * blurred.values[i];
    weight_sum += weight;
  }
  for (double& value : result.values) value /= weight_sum;
  return result;
}

/// Replaces each pixel by what `convert` makes of it.
template <class Convert>
void convert_pixels(RgbPlanes& planes, const Convert& convert) {
  parallel_for(size_t(planes[0].height), [&](size_t y) {
    const auto a = planes[0].row(int(y)), b = planes[1].row(int(y)), c = planes[2].row(int(y));
    for (size_t x = 0; x < a.size(); ++x) {
      const Vec3d converted = convert(Vec3d(a[x], b[x], c[x]));
      a[x] = converted.x;
      b[x] = converted.y;
      c[x] = converted.z;
    }
  });
}

/// From YCxCz to the Hunt-adjusted L*a*b* of the picture as the eye resolves it.
RgbPlanes perceived(const RgbPlanes& ycxcz, double pixels_per_degree) {
  RgbPlanes planes{contrast_filter(ycxcz[0], kAchromatic, pixels_per_degree),
                   contrast_filter(ycxcz[1], kRedGreen, pixels_per_degree),
                   contrast_filter(ycxcz[2], kBlueYellow, pixels_per_degree)};
  convert_pixels(planes, [](const Vec3d& c) {
    const Vec3d rgb = rgb_from_ycxcz(c);
    return hunt_lab_from_rgb(
        {std::clamp(rgb.x, 0.0, 1.0), std::clamp(rgb.y, 0.0, 1.0), std::clamp(rgb.z, 0.0, 1.0)});
  });
  return planes;
}

/// HyAB distance of two colours in Hunt-adjusted L*a*b*, compressed by the exponent q_c = 0.7.
double compressed_distance(const Vec3d& p, const Vec3d& q) {
  return std::pow(std::abs(p.x - q.x) + std::hypot(p.y - q.y, p.z - q.z), 0.7);
}

/// Maps compressed distances to [0, 1]: up to p_c = 0.4 of the largest (green against blue) to [0, p_t =
/// 0.95], the rest to what remains.
double colour_difference(double distance) {
  static const double kLargest =
      compressed_distance(hunt_lab_from_rgb({0, 1, 0}), hunt_lab_from_rgb({0, 0, 1}));
  const double knee = 0.4 * kLargest;
  if (distance < knee) return 0.95 * distance / knee;
  return 0.95 + 0.05 * (distance - knee) / (kLargest - knee);
}

Plane colour_difference_map(const RgbPlanes& test, const RgbPlanes& reference, double pixels_per_degree) {
  const RgbPlanes p = perceived(test, pixels_per_degree), q = perceived(reference, pixels_per_degree);
  Plane map(p[0].width, p[0].height);
  parallel_for(size_t(map.height), [&](size_t y) {
    const size_t begin = y * size_t(map.width);
    for (size_t i = begin; i < begin + size_t(map.width); ++i) {
      map.values[i] =
          colour_difference(compressed_distance({p[0].values[i], p[1].values[i], p[2].values[i]},
                                                {q[0].values[i], q[1].values[i], q[2].values[i]}));
    }
  });
  return map;
}

// ---- feature pipeline ----

/// Scales the positive weights to sum 1 and the negative ones to sum -1.
void balance(std::vector<double>& kernel) {
  double positive = 0.0, negative = 0.0;
  for (const double weight : kernel) (weight > 0.0 ? positive : negative) += std::abs(weight);
  for (double& weight : kernel) weight /= weight > 0.0 ? positive : negative;
}

struct FeatureKernels {
  std::vector<double> smooth, edge, point;
};

/// A Gaussian as wide as the eye's edge detector (0.082 deg from peak to trough), its first and its second
/// derivative.
FeatureKernels feature_kernels(double pixels_per_degree) {
  const double sigma = 0.5 * 0.082 * pixels_per_degree;
  const int radius = int(std::ceil(3.0 * sigma));
  FeatureKernels kernels{gaussian_kernel(sigma, radius), {}, {}};
  for (int x = -radius; x <= radius; ++x) {
    const double g = kernels.smooth[kernels.edge.size()];
    kernels.edge.push_back(-x * g);
    kernels.point.push_back((double(x) * double(x) / (sigma * sigma) - 1.0) * g);
  }
  balance(kernels.edge);
  balance(kernels.point);
  return kernels;
}

/// How strongly `derivative` responds at each pixel, along x and along y taken together.
Plane feature_map(const Plane& luminance, std::span<const double> derivative,
                  std::span<const double> smooth) {
  Plane along_x = filter_separably(luminance, derivative, smooth, Border::replicate);
  const Plane along_y = filter_separably(luminance, smooth, derivative, Border::replicate);
  for (size_t i = 0; i < along_x.values.size(); ++i) {
    along_x.values[i] = std::hypot(along_x.values[i], along_y.values[i]);
  }
  return along_x;
}

Plane absolute_difference(Plane a, const Plane& b) {
  for (size_t i = 0; i < a.values.size(); ++i) a.values[i] = std::abs(a.values[i] - b.values[i]);
  return a;
}

/// How much edges and points differ: ((1 / sqrt 2) * the larger difference)^0.5.
Plane feature_difference_map(const Plane& test, const Plane& reference, double pixels_per_degree) {
  const FeatureKernels kernels = feature_kernels(pixels_per_degree);
  const auto difference = [&](const std::vector<double>& derivative) {
    return absolute_difference(feature_map(test, derivative, kernels.smooth),
                               feature_map(reference, derivative, kernels.smooth));
  };
  Plane map = difference(kernels.edge);
  const Plane points = difference(kernels.point);
  for (size_t i = 0; i < map.values.size(); ++i) {
    map.values[i] = std::sqrt(std::max(map.values[i], points.values[i]) / std::numbers::sqrt2);
  }
  return map;
}

/// The achromatic channel in [0, 1].
Plane luminance_of(const Plane& y) {
  Plane result = y;
  for (double& value : result.values) value = (value + 16.0) / 116.0;
  return result;
}

}  // namespace

Plane flip_map(RgbPlanes test, RgbPlanes reference, double pixels_per_degree) {
  PILEUS_CHECK(test[0].width == reference[0].width && test[0].height == reference[0].height);
  PILEUS_CHECK(pixels_per_degree > 0.0);
  convert_pixels(test, ycxcz_from_rgb);
  convert_pixels(reference, ycxcz_from_rgb);

  Plane map = colour_difference_map(test, reference, pixels_per_degree);
  const Plane features =
      feature_difference_map(luminance_of(test[0]), luminance_of(reference[0]), pixels_per_degree);

  // Differences of features amplify differences of colour: c^(1 - f).
  parallel_for(size_t(map.height), [&](size_t y) {
    const auto row = map.row(int(y));
    const auto feature_row = features.row(int(y));
    for (size_t x = 0; x < row.size(); ++x) row[x] = std::pow(row[x], 1.0 - feature_row[x]);
  });
  return map;
}

}  // namespace pileus
