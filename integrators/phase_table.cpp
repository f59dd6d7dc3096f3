#include "integrators/phase_table.h"

#include <cmath>

namespace pileus {
namespace {

double value_at(const PhaseFunction& phase, double s) {
  const bool is_ahead = s <= 0.5 * PhaseTable::kWhole;
  const double near = is_ahead ? s : PhaseTable::kWhole - s;  // sine or cosine of half the angle
  const double far = std::sqrt(1.0 - near * near), sine = 2.0 * near * far;
  const double cosine = is_ahead ? 1.0 - 2.0 * near * near : 2.0 * near * near - 1.0;
  return phase.p({0.0, 0.0, 1.0}, {sine, 0.0, -cosine});
}

std::vector<float> values_at_nodes(const PhaseFunction& phase, size_t intervals) {
  std::vector<float> values(intervals + 1);
  for (size_t i = 0; i <= intervals; ++i)
    values[i] = float(value_at(phase, PhaseTable::kWhole * double(i) / double(intervals)));
  return values;
}

/// Of linear interpolation, half way between nodes, relative to values that count.
double relative_error(const PhaseFunction& phase, const std::vector<float>& values) {
  constexpr double kNegligible = 1e-4 * 0.25 * std::numbers::inv_pi;
  const size_t intervals = values.size() - 1;
  double worst = 0.0;
  for (size_t i = 0; i < intervals; ++i) {
    const double between = 0.5 * (double(values[i]) + double(values[i + 1])),
                 p = value_at(phase, PhaseTable::kWhole * (double(i) + 0.5) / double(intervals));
    worst = std::max(worst, std::abs(between - p) / std::max(p, kNegligible));
  }
  return worst;
}

void find_parts(PhaseTable& table) {
  const size_t intervals = table.values.size() - 1;
  for (size_t part = 0; part < size_t(PhaseTable::kParts); ++part) {
    // Together with the intervals on both sides, as whoever asks may lie a rounding beyond.
    const size_t first = part * intervals / PhaseTable::kParts,
                 last = (part + 1) * intervals / PhaseTable::kParts;
    PhaseTable::Part& of = table.parts[part];
    for (size_t i = first > 0 ? first - 1 : 0; i < std::min(last + 2, intervals); ++i) {
      const double a = double(table.values[i]), b = double(table.values[i + 1]);
      of.most = std::max({of.most, a, b});
      of.steepest = std::max(of.steepest, std::abs(b - a) * double(intervals) / PhaseTable::kWhole);
    }
  }
}

}  // namespace

PhaseTable phase_table(const PhaseFunction& phase) {
  constexpr size_t kFewest = 128, kMost = size_t(1) << 16;
  constexpr double kAllowed = 5e-5;
  PhaseTable table;
  if (phase.is_isotropic()) {
    table.values = values_at_nodes(phase, 1);
  } else {
    for (size_t intervals = kFewest; intervals <= kMost; intervals *= 2) {
      table.values = values_at_nodes(phase, intervals);
      table.error = relative_error(phase, table.values);
      if (table.error <= kAllowed) break;
    }
  }
  find_parts(table);
  return table;
}

double phase_at(const PhaseTable& table, double s) {
  const double intervals = double(table.values.size() - 1),
               x = std::clamp(s / PhaseTable::kWhole, 0.0, 1.0) * intervals;
  const size_t i = std::min(size_t(x), table.values.size() - 2);
  return std::lerp(double(table.values[i]), double(table.values[i + 1]), x - double(i));
}

double phase_coordinate(const Vec3d& wo, const Vec3d& wi) {
  const double sine2 = 0.25 * dot(wo + wi, wo + wi), cosine2 = 0.25 * dot(wo - wi, wo - wi);
  return sine2 <= cosine2 ? std::sqrt(sine2) : PhaseTable::kWhole - std::sqrt(cosine2);
}

}  // namespace pileus
