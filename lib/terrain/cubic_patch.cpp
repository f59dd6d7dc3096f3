#include "lib/terrain/cubic_patch.h"

#include <algorithm>
#include <cmath>

namespace pileus {
namespace {

using Four = std::array<double, 4>;

/// Catmull-Rom's weights, in forms that are exactly 0, 1, 0, 0 and 0, 0, 1, 0 at both ends.
Four weights(double s) {
  const double back = 1.0 - s;
  return {-0.5 * s * back * back, back * (1.0 + s - 1.5 * s * s), s * (0.5 + 2.0 * s - 1.5 * s * s),
          -0.5 * s * s * back};
}

Four weight_slopes(double s) {
  return {-0.5 * (1.0 - s) * (1.0 - 3.0 * s), s * (4.5 * s - 5.0), 0.5 + s * (4.0 - 4.5 * s),
          s * (1.5 * s - 1.0)};
}

double weighted(const double (&z)[4][4], const Four& along_columns, const Four& along_rows) {
  double sum = 0.0;
  for (size_t i = 0; i < 4; ++i) {
    const double column =
        along_rows[0] * z[0][i] + along_rows[1] * z[1][i] + along_rows[2] * z[2][i] + along_rows[3] * z[3][i];
    sum += along_columns[i] * column;
  }
  return sum;
}

/// The same cubic by Bezier's control values.
Four bezier(double p0, double p1, double p2, double p3) {
  return {p1, p1 + (p2 - p0) / 6.0, p2 - (p3 - p1) / 6.0, p2};
}

/// Control values of the stretch from a to b of a cubic: its polar form at a's and b's.
Four stretch(const Four& z, double a, double b) {
  Four result;
  for (size_t k = 0; k < 4; ++k) {
    Four part = z;
    for (size_t round = 0; round < 3; ++round) {
      const double x = round < k ? b : a;
      for (size_t n = 0; n + round < 3; ++n) part[n] = lerp(part[n], part[n + 1], x);
    }
    result[k] = part[0];
  }
  return result;
}

}  // namespace

CubicPatch::CubicPatch(const HeightTable& table, int i, int j) {
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      const int u = i + column - 1, v = j + row - 1;
      const bool is_there = u >= 0 && v >= 0 && u < table.columns && v < table.rows;
      m_z[row][column] = is_there ? double(table.at(u, v)) : std::numeric_limits<double>::quiet_NaN();
    }
  }
  if (has_data()) fill_borders();
}

bool CubicPatch::has_data() const {
  return !std::isnan((m_z[1][1] + m_z[1][2]) + (m_z[2][1] + m_z[2][2]));
}

void CubicPatch::fill_borders() {
  const auto fill = [](double& z, double near, double far) {
    if (std::isnan(z)) z = 2.0 * near - far;
  };
  for (int k = 1; k <= 2; ++k) {
    fill(m_z[0][k], m_z[1][k], m_z[2][k]);
    fill(m_z[3][k], m_z[2][k], m_z[1][k]);
    fill(m_z[k][0], m_z[k][1], m_z[k][2]);
    fill(m_z[k][3], m_z[k][2], m_z[k][1]);
  }
  // Corners count nowhere on the cell's edges: any finite height does.
  for (const int row : {0, 3}) {
    const int inner_row = row == 0 ? 1 : 2;
    for (const int column : {0, 3}) {
      const int inner = column == 0 ? 1 : 2;
      if (std::isnan(m_z[row][column]))
        m_z[row][column] = m_z[row][inner] + m_z[inner_row][column] - m_z[inner_row][inner];
    }
  }
}

double CubicPatch::at(double s, double r) const {
  return weighted(m_z, weights(s), weights(r));
}

std::array<double, 2> CubicPatch::slope(double s, double r) const {
  return {weighted(m_z, weight_slopes(s), weights(r)), weighted(m_z, weights(s), weight_slopes(r))};
}

CubicPatch::Control CubicPatch::control() const {
  Control rows, control;
  for (size_t k = 0; k < 4; ++k) rows[k] = bezier(m_z[k][0], m_z[k][1], m_z[k][2], m_z[k][3]);
  for (size_t i = 0; i < 4; ++i) {
    const Four column = bezier(rows[0][i], rows[1][i], rows[2][i], rows[3][i]);
    for (size_t k = 0; k < 4; ++k) control[k][i] = column[k];
  }
  return control;
}

HeightRange cubic_range(const CubicPatch& patch) {
  if (!patch.has_data()) return {};
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  HeightRange range;
  for (const auto& row : patch.control()) {
    for (const double z : row) range.extend(float(z));
  }
  return {std::nextafter(range.least, -kInfinity), std::nextafter(range.greatest, kInfinity)};
}

std::array<double, 7> along_line(const CubicPatch::Control& control, double s0, double r0, double s1,
                                 double r1) {
  constexpr double kBinomial3[4] = {1, 3, 3, 1}, kBinomial6[7] = {1, 6, 15, 20, 15, 6, 1};
  CubicPatch::Control part;
  for (size_t k = 0; k < 4; ++k) part[k] = stretch(control[k], s0, s1);
  std::array<double, 7> sums{};
  for (size_t i = 0; i < 4; ++i) {
    const Four column = stretch({part[0][i], part[1][i], part[2][i], part[3][i]}, r0, r1);
    for (size_t k = 0; k < 4; ++k) sums[i + k] += kBinomial3[i] * kBinomial3[k] * column[k];
  }
  for (size_t k = 0; k < 7; ++k) sums[k] /= kBinomial6[k];
  return sums;
}

}  // namespace pileus
