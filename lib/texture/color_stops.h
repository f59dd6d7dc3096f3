#pragma once

#include <string>
#include <vector>

#include "lib/math/interval.h"
#include "lib/math/vec.h"

namespace pileus {

class ParamTable;
struct Param;

struct ColorStop {
  double at = 0.0;
  Rgb color{0.0, 0.0, 0.0};
};

/// Colours along a quantity: linear between stops, constant before the first and after the last.
class ColorStops {
 public:
  ColorStops() = default;

  /// stops: at least one, `at` rising
  explicit ColorStops(std::vector<ColorStop> stops) : m_stops(std::move(stops)) {}

  /// Declares a list of stops: `stops = [{ at = 0, color = [1, 0, 0] }, ...]`, where none are given as they
  /// are now.
  Param& describe(ParamTable& params, const std::string& unit, const std::string& help);

  /// Appends what is wrong with the stops, if anything.
  void check(std::vector<std::string>& problems) const;

  Rgb at(double x) const;

  /// The mean over an interval, exactly; the colour at its middle where it has no width.
  Rgb mean(const Interval& x) const;

 private:
  /// The integral from the first stop to x.
  Rgb integral(double x) const;

  std::vector<ColorStop> m_stops;
  bool m_is_default = true;
};

}  // namespace pileus
