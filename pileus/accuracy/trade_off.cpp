#include "pileus/accuracy/trade_off.h"

#include <algorithm>
#include <cmath>

namespace pileus {
namespace {

bool is_finite(const CostError& point) {
  return std::isfinite(point.cost) && std::isfinite(point.error);
}

bool beats(const CostError& a, const CostError& b) {
  return a.cost <= b.cost && a.error <= b.error && (a.cost < b.cost || a.error < b.error);
}

/// What the method can do: its front, in the order of cost, so that errors fall from one to the next.
std::vector<CostError> front_by_cost(std::span<const CostError> points) {
  const std::vector<bool> is_on_front = pareto_front(points);
  std::vector<CostError> front;
  for (size_t i = 0; i < points.size(); ++i) {
    if (is_on_front[i] && points[i].cost > 0.0 && points[i].error > 0.0) front.push_back(points[i]);
  }
  std::sort(front.begin(), front.end(),
            [](const CostError& a, const CostError& b) { return a.cost < b.cost; });
  return front;
}

/// y at x on the line through two points of a log-log plot.
double on_line(double x0, double y0, double x1, double y1, double x) {
  if (x0 == x1) return y1;
  return y0 * std::pow(y1 / y0, std::log(x / x0) / std::log(x1 / x0));
}

}  // namespace

std::vector<bool> pareto_front(std::span<const CostError> points) {
  std::vector<bool> is_on_front(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    is_on_front[i] =
        is_finite(points[i]) && std::none_of(points.begin(), points.end(), [&](const CostError& other) {
          return is_finite(other) && beats(other, points[i]);
        });
  }
  return is_on_front;
}

ReadOff cost_at_error(std::span<const CostError> points, double error) {
  const std::vector<CostError> front = front_by_cost(points);
  if (front.empty() || error < front.back().error) return {};
  if (error >= front.front().error) return {ReadOff::Kind::at_most, front.front().cost};
  const auto after =
      std::find_if(front.begin(), front.end(), [&](auto& point) { return point.error <= error; });
  const CostError &a = after[-1], &b = *after;
  return {ReadOff::Kind::interpolated, on_line(a.error, a.cost, b.error, b.cost, error)};
}

ReadOff error_at_cost(std::span<const CostError> points, double cost) {
  const std::vector<CostError> front = front_by_cost(points);
  if (front.empty() || cost < front.front().cost) return {};
  if (cost >= front.back().cost) return {ReadOff::Kind::at_most, front.back().error};
  const auto after = std::find_if(front.begin(), front.end(), [&](auto& point) { return point.cost > cost; });
  const CostError &a = after[-1], &b = *after;
  return {ReadOff::Kind::interpolated, on_line(a.cost, a.error, b.cost, b.error, cost)};
}

}  // namespace pileus
