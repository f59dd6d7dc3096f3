#include "lib/terrain/sign_changes.h"

#include <cmath>

#include "lib/math/lerp.h"

namespace pileus {
namespace {

using Sextic = std::array<double, 7>;

int variations(const Sextic& g) {
  int count = 0;
  for (size_t k = 1; k < g.size(); ++k) count += (g[k] > 0.0) != (g[k - 1] > 0.0);
  return count;
}

double value_at(Sextic g, double s) {
  for (size_t n = g.size() - 1; n > 0; --n) {
    for (size_t k = 0; k < n; ++k) g[k] = lerp(g[k], g[k + 1], s);
  }
  return g[0];
}

/// The coefficients on both halves.
std::array<Sextic, 2> halves(Sextic g) {
  std::array<Sextic, 2> parts;
  for (size_t n = 0; n < g.size(); ++n) {
    parts[0][n] = g[0];
    parts[1][g.size() - 1 - n] = g[g.size() - 1 - n];
    for (size_t k = 0; k + 1 + n < g.size(); ++k) g[k] = 0.5 * (g[k] + g[k + 1]);
  }
  return parts;
}

/// The one root between ends of different sign: false position that halves the weight of an end that stays.
double only_root(const Sextic& g) {
  constexpr int kMostSteps = 100;
  constexpr double kNarrow = 1e-16;
  double a = 0.0, b = 1.0, at_a = g.front(), at_b = g.back();
  int stays = 0;
  for (int step = 0; step < kMostSteps && b - a > kNarrow; ++step) {
    const double guess = a + (b - a) * (at_a / (at_a - at_b));
    const double s = guess > a && guess < b ? guess : 0.5 * (a + b);
    if (!(s > a && s < b)) break;
    const double here = value_at(g, s);
    if (here == 0.0) return s;
    if ((here > 0.0) == (g.front() > 0.0)) {
      a = s, at_a = here;
      if (stays == 1) at_b *= 0.5;
      stays = 1;
    } else {
      b = s, at_b = here;
      if (stays == -1) at_a *= 0.5;
      stays = -1;
    }
  }
  return 0.5 * (a + b);
}

void find(const Sextic& g, double a, double b, int halvings_left, SignChanges& found) {
  const int changes = variations(g);
  if (changes == 0) return;
  const bool ends_differ = (g.front() > 0.0) != (g.back() > 0.0);
  if (changes == 1 || halvings_left == 0) {
    const bool has_room = size_t(found.count) < found.s.size();
    if (ends_differ && has_room) found.s[size_t(found.count++)] = lerp(a, b, only_root(g));
    return;
  }
  const double middle = 0.5 * (a + b);
  const std::array<Sextic, 2> parts = halves(g);
  find(parts[0], a, middle, halvings_left - 1, found);
  find(parts[1], middle, b, halvings_left - 1, found);
}

}  // namespace

SignChanges sign_changes(std::array<double, 3> g) {
  const bool above0 = g[0] > 0.0, above2 = g[2] > 0.0;
  if (!above0) g = {-g[0], -g[1], -g[2]};
  if (above0 != above2) {
    const double root = std::sqrt(g[1] * g[1] - g[0] * g[2]);
    if (g[1] > 0.0) return {1, {(root + g[1]) / (root + g[1] - g[2])}};
    const double sum = g[0] + (root - g[1]);
    return {1, {sum > 0.0 ? g[0] / sum : 0.0}};
  }
  if (g[1] >= 0.0) return {};  // all coefficients on one side: so is the curve
  const double discriminant = g[1] * g[1] - g[0] * g[2];
  if (!(discriminant > 0.0)) return {};
  const double root = std::sqrt(discriminant);
  return {2, {g[0] / (g[0] - g[1] + root), (root - g[1]) / (root - g[1] + g[2])}};
}

SignChanges sign_changes(const std::array<double, 7>& g) {
  constexpr int kHalvings = 40;
  SignChanges found;
  find(g, 0.0, 1.0, kHalvings, found);
  return found;
}

}  // namespace pileus
