// The kernels' exponentials and interpolation, on every instruction set, against long double.
#include "tests/simd/math_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/fixtures/simd_targets.h"
#include "tests/reference/trilinear_reference.h"

namespace pileus {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kLeastNormal = std::numeric_limits<float>::min();

/// Distance from the true value in units of the float's last place there.
double ulps(float got, long double expected) {
  int exponent;
  std::frexp(expected, &exponent);
  return double(std::abs(got - expected) / std::ldexp(1.0L, std::max(exponent, -125) - 24));
}

/// Optical depths of all sizes from the smallest normal float to 87, and many around 1.
std::vector<float> depths() {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> exponent(-126.0, 6.44), linear(0.0, 87.0), small(0.0, 2.0);
  std::vector<float> taus;
  for (int n = 0; n < 200000; ++n) {
    taus.push_back(float(std::exp2(exponent(random))));
    taus.push_back(float(linear(random)));
    taus.push_back(float(small(random)));
  }
  for (int n = 0; n <= 250; ++n) {  // where the reduction changes its integer
    const float border = float((n + 0.5) * 0.34657359027997264);
    if (border >= 87.0f) break;
    for (const float tau : {std::nextafter(border, 0.0f), border, std::nextafter(border, 100.0f)})
      taus.push_back(tau);
  }
  taus.push_back(kLeastNormal);
  taus.push_back(87.0f);
  return taus;
}

TEST(MathKernels, there_are_several_targets) {
  std::set<std::string> names;
  const int count = for_each_simd_target([&](const std::string& name) {
    EXPECT_EQ(name, math_target());
    names.insert(name);
  });
  EXPECT_EQ(names.size(), size_t(count));
  EXPECT_GE(count, 1);
}

TEST(MathKernels, transmittance_to_two_ulp) {
  const std::vector<float> taus = depths();
  std::vector<float> got(taus.size());
  for_each_simd_target([&](const std::string& target) {
    transmittances(taus, got);
    double worst = 0.0;
    for (size_t i = 0; i < taus.size(); ++i) {
      const double off = ulps(got[i], std::exp(-static_cast<long double>(taus[i])));
      worst = std::max(worst, off);
      ASSERT_LE(off, 2.0) << target << ", tau = " << taus[i];
    }
    RecordProperty("worst_ulp_" + target, std::to_string(worst));
  });
}

TEST(MathKernels, opacity_to_three_ulp_however_small) {
  const std::vector<float> taus = depths();
  std::vector<float> got(taus.size());
  for_each_simd_target([&](const std::string& target) {
    opacities(taus, got);
    double worst = 0.0;
    for (size_t i = 0; i < taus.size(); ++i) {
      const double off = ulps(got[i], -std::expm1(-static_cast<long double>(taus[i])));
      worst = std::max(worst, off);
      ASSERT_LE(off, 3.0) << target << ", tau = " << taus[i];
      ASSERT_LE(got[i], 1.0f) << target << ", tau = " << taus[i];
      ASSERT_GE(got[i], 0.0f) << target << ", tau = " << taus[i];
    }
    RecordProperty("worst_ulp_" + target, std::to_string(worst));
  });
}

TEST(MathKernels, the_sum_of_both_is_one) {
  const std::vector<float> taus = depths();
  std::vector<float> through(taus.size()), opaque(taus.size());
  for_each_simd_target([&](const std::string& target) {
    transmittances(taus, through);
    opacities(taus, opaque);
    for (size_t i = 0; i < taus.size(); ++i)
      ASSERT_NEAR(double(through[i]) + double(opaque[i]), 1.0, 2.4e-7) << target << ", tau = " << taus[i];
  });
}

TEST(MathKernels, depths_slightly_below_zero) {
  // Balanced lattices of optical depth have such nodes.
  std::mt19937 random(32);
  std::uniform_real_distribution<double> exponent(-126.0, 6.32);
  std::vector<float> taus;
  for (int n = 0; n < 100000; ++n) taus.push_back(-float(std::exp2(exponent(random))));  // down to -80
  std::vector<float> got(taus.size());
  for_each_simd_target([&](const std::string& target) {
    transmittances(taus, got);
    for (size_t i = 0; i < taus.size(); ++i)
      ASSERT_LE(ulps(got[i], std::exp(-static_cast<long double>(taus[i]))), 2.0) << target << ' ' << taus[i];
    opacities(taus, got);
    for (size_t i = 0; i < taus.size(); ++i)
      ASSERT_LE(ulps(got[i], -std::expm1(-static_cast<long double>(taus[i]))), 3.0)
          << target << ' ' << taus[i];
  });
}

TEST(MathKernels, ends_of_the_range) {
  for_each_simd_target([&](const std::string& target) {
    const auto both = [](float tau) {
      std::array<float, 2> result;
      transmittances({&tau, 1}, {&result[0], 1});
      opacities({&tau, 1}, {&result[1], 1});
      return result;
    };
    EXPECT_EQ(both(0.0f), (std::array{1.0f, 0.0f})) << target;
    EXPECT_EQ(both(-0.0f)[0], 1.0f) << target;
    for (const float tau : {std::numeric_limits<float>::denorm_min(), 1e-40f, kLeastNormal}) {
      EXPECT_EQ(both(tau)[0], 1.0f) << target;
      EXPECT_EQ(both(tau)[1], tau) << target << ": 1 - exp(-tau) is tau to the last bit";
    }
    for (const float tau : {87.0f, 87.5f, 1000.0f, 1e30f, std::numeric_limits<float>::max(), kInfinity}) {
      EXPECT_EQ(both(tau)[1], 1.0f) << target << ", tau = " << tau;
      EXPECT_LE(both(tau)[0], 1.7e-38f) << target << ", tau = " << tau;
      EXPECT_GE(both(tau)[0], 0.0f) << target << ", tau = " << tau;
    }
  });
}

class TrilinearKernel : public testing::Test {
 protected:
  static constexpr size_t kCount = 50007;  // no multiple of any vector
  std::vector<float> m_values, m_x, m_y, m_z, m_got;
  std::vector<int32_t> m_index;
  std::mt19937 m_random{33};

  TrilinearKernel()
      : m_values(3 * 736), m_x(kCount), m_y(kCount), m_z(kCount), m_got(kCount), m_index(kCount) {
    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    for (float& value : m_values)
      value = uniform(m_random) < 0.2f ? 0.0f : std::exp2(40.0f * uniform(m_random) - 20.0f);
    for (size_t i = 0; i < kCount; ++i) {
      const auto pick = [&] { return int32_t(m_random() % 8); };
      m_index[i] = int32_t(m_random() % 3) * 736 + pick() * 81 + pick() * 9 + pick();
      const auto place = [&] {
        const unsigned kind = m_random() % 8;
        return kind == 0   ? 0.0f
               : kind == 1 ? 1.0f
               : kind == 2 ? std::nextafter(1.0f, 0.0f)
                           : uniform(m_random);
      };
      m_x[i] = place(), m_y[i] = place(), m_z[i] = place();
    }
  }

  std::array<float, 8> corners(size_t i) const {
    const float* at = m_values.data() + m_index[i];
    return {at[0], at[81], at[9], at[90], at[1], at[82], at[10], at[91]};
  }
};

TEST_F(TrilinearKernel, agrees_with_the_definition) {
  for_each_simd_target([&](const std::string& target) {
    trilinears(m_values.data(), m_index, m_x, m_y, m_z, m_got);
    for (size_t i = 0; i < kCount; ++i) {
      const std::array<float, 8> c = corners(i);
      const auto [lo, hi] = std::minmax_element(c.begin(), c.end());
      const long double expected = reference::trilinear(c, m_x[i], m_y[i], m_z[i]);
      // Three lerps deep, two roundings each, none larger than that of the largest corner.
      const double allowed = 6.0 * 0.5 * double(std::numeric_limits<float>::epsilon()) * double(*hi);
      ASSERT_NEAR(double(m_got[i]), double(expected), allowed) << target << ", " << i;
      ASSERT_GE(double(m_got[i]), std::max(0.0, double(*lo) - allowed)) << target << ", " << i;
      ASSERT_LE(m_got[i], *hi * (1.0f + 4e-7f)) << target << ", " << i << ": above all corners";
    }
  });
}

TEST_F(TrilinearKernel, gives_the_corners_themselves) {
  for (size_t i = 0; i < kCount; ++i) m_x[i] = float(i & 1), m_y[i] = 0.0f, m_z[i] = 0.0f;
  for_each_simd_target([&](const std::string& target) {
    trilinears(m_values.data(), m_index, m_x, m_y, m_z, m_got);
    for (size_t i = 0; i < kCount; ++i) {
      const std::array<float, 8> c = corners(i);
      // At the upper end of a lerp the difference has been rounded.
      const double allowed =
          i & 1 ? double(std::numeric_limits<float>::epsilon() * std::max(c[0], c[1])) : 0.0;
      ASSERT_NEAR(double(m_got[i]), double(c[i & 1]), allowed) << target;
    }
  });
}

TEST_F(TrilinearKernel, constants_stay_constant) {
  std::fill(m_values.begin(), m_values.end(), 0.7f);
  for_each_simd_target([&](const std::string& target) {
    trilinears(m_values.data(), m_index, m_x, m_y, m_z, m_got);
    for (size_t i = 0; i < kCount; ++i) ASSERT_EQ(m_got[i], 0.7f) << target;
  });
}

/// 16-bit values: the same cells, with values rounded to steps.
class QuantizedTrilinearKernel : public TrilinearKernel {
 protected:
  std::vector<int16_t> m_stored;

  QuantizedTrilinearKernel() : m_stored(m_values.size()) {
    for (size_t i = 0; i < m_stored.size(); ++i) {
      const unsigned kind = m_random() % 6;
      m_stored[i] = kind == 0   ? int16_t(-32768)
                    : kind == 1 ? int16_t(32767)
                                : int16_t(m_random() % 65536 - 32768);
    }
  }

  std::array<float, 8> steps(size_t i) const {
    const int16_t* at = m_stored.data() + m_index[i];
    std::array<float, 8> steps;
    constexpr int kOffsets[] = {0, 81, 9, 90, 1, 82, 10, 91};
    for (size_t n = 0; n < 8; ++n) steps[n] = float(at[kOffsets[n]] + 32768);
    return steps;
  }
};

TEST_F(QuantizedTrilinearKernel, agrees_with_the_definition) {
  for_each_simd_target([&](const std::string& target) {
    quantized_trilinears(m_stored.data(), m_index, m_x, m_y, m_z, m_got);
    for (size_t i = 0; i < kCount; ++i) {
      const std::array<float, 8> c = steps(i);
      const auto [lo, hi] = std::minmax_element(c.begin(), c.end());
      const long double z = std::nearbyint(static_cast<long double>(m_z[i]) * 32767.0L) / 32767.0L;
      // Rounding of floats, and of z where its product with 32767 is near one half.
      const double rounding = 5.0 * double(std::numeric_limits<float>::epsilon()) * double(*hi);
      double off = 1e30;
      for (const long double near : {z, z - 1.0L / 32767.0L, z + 1.0L / 32767.0L}) {
        if (std::abs(near - static_cast<long double>(m_z[i])) > 0.502L / 32767.0L) continue;
        off =
            std::min(off, std::abs(double(m_got[i]) - double(reference::trilinear(c, m_x[i], m_y[i], near))));
      }
      ASSERT_LE(off, rounding) << target << ", " << i;
      ASSERT_GE(double(m_got[i]), std::max(0.0, double(*lo) - rounding)) << target << ", " << i;
      ASSERT_LE(double(m_got[i]), double(*hi) + rounding) << target << ", " << i;
    }
  });
}

TEST_F(QuantizedTrilinearKernel, constants_stay_constant_and_zero_is_zero) {
  for (const int step : {0, 1, 777, 65535}) {
    std::fill(m_stored.begin(), m_stored.end(), int16_t(step - 32768));
    for_each_simd_target([&](const std::string& target) {
      quantized_trilinears(m_stored.data(), m_index, m_x, m_y, m_z, m_got);
      for (size_t i = 0; i < kCount; ++i) ASSERT_NEAR(double(m_got[i]), step, 1e-7 * step) << target;
    });
  }
}

TEST(MathKernels, every_length_of_array) {
  for_each_simd_target([&](const std::string& target) {
    for (size_t n = 1; n < 40; ++n) {
      std::vector<float> taus(n), got(n + 1, -5.0f);
      for (size_t i = 0; i < n; ++i) taus[i] = 0.1f * float(i);
      transmittances(taus, std::span(got).first(n));
      for (size_t i = 0; i < n; ++i) EXPECT_NEAR(got[i], std::exp(-taus[i]), 1e-6f) << target;
      EXPECT_EQ(got[n], -5.0f) << target;
    }
  });
}

}  // namespace
}  // namespace pileus
