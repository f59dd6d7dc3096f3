#include "lib/fog/fog_on_ray.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lib/math/gauss_kronrod.h"
#include "lib/math/transmittance.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kFarthest = 1e15;  ///< [m]
constexpr double kOpaque = 45.0;    ///< optical depth behind which nothing counts

double largest(const Rgb& rgb) {
  return std::max({std::abs(rgb.x), std::abs(rgb.y), std::abs(rgb.z)});
}

bool is_homogeneous(const FogPiece& piece) {
  return piece.law == FogPiece::Law::constant && piece.source != FogPiece::Source::sunlit &&
         piece.colour_slope == Rgb(0.0);
}

/// The light of overlapping pieces, by adaptive Gauss–Kronrod panels.
class OverlapQuadrature {
 public:
  OverlapQuadrature(std::span<const FogPiece> pieces, double accuracy)
      : m_pieces(pieces), m_accuracy(accuracy) {}

  Rgb integrate(double s) {
    const double end = visible_length(s);
    if (!(end > 0.0)) return Rgb(0.0);
    std::vector<double> cuts = places_of_change(end);
    Rgb sum(0.0);
    const double tolerance = m_accuracy * brightest(end) / double(cuts.size());
    for (size_t i = 0; i + 1 < cuts.size(); ++i) sum += panel(cuts[i], cuts[i + 1], tolerance, 0);
    return sum;
  }

 private:
  /// Behind it nothing shows, or there is no fog.
  double visible_length(double s) const {
    for (const FogPiece& piece : m_pieces) s = std::min(s, depth_inverse(piece, kOpaque));
    if (std::isfinite(s)) return s;
    double thickest = 0.0;
    for (const FogPiece& piece : m_pieces) {
      if (piece.law == FogPiece::Law::height && piece.rise > 0.0)
        thickest = std::max(thickest, kOpaque * piece.profile.scale / piece.rise);
    }
    return thickest;
  }

  /// 0, end, and places between where some piece has made a difference: no thin fog slips through between
  /// the points of a long panel.
  std::vector<double> places_of_change(double end) const {
    std::vector<double> cuts{0.0, end};
    for (const FogPiece& piece : m_pieces) {
      for (const double tau : {0.3, 2.0, 8.0}) cuts.push_back(depth_inverse(piece, tau));
      if (piece.law != FogPiece::Law::height || piece.rise == 0.0) continue;
      for (const double heights : {1.0, 4.0, 15.0, kOpaque}) {
        const double z = heights * piece.profile.scale;
        cuts.push_back(piece.rise > 0.0 ? z / piece.rise : (piece.z0 - z) / -piece.rise);
      }
    }
    std::erase_if(cuts, [&](double cut) { return !(cut >= 0.0 && cut <= end); });
    std::sort(cuts.begin(), cuts.end());
    cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
    return cuts;
  }

  double brightest(double end) const {
    double most = 0.0;
    for (const FogPiece& piece : m_pieces) {
      most = std::max({most, largest(piece.colour), largest(source_at(piece, end))});
    }
    return most;
  }

  Rgb panel(double from, double to, double tolerance, int depth) {
    constexpr int kMostHalvings = 30;
    Rgb kronrod(0.0), gauss(0.0);
    for (const auto& node : GaussKronrod7::kNodes) {
      const Rgb f = (to - from) * rate(from + node.x * (to - from));
      kronrod += node.kronrod * f;
      gauss += node.gauss * f;
    }
    if (!(largest(kronrod - gauss) > tolerance) || depth == kMostHalvings) return kronrod;
    const double middle = 0.5 * (from + to);
    return panel(from, middle, 0.5 * tolerance, depth + 1) + panel(middle, to, 0.5 * tolerance, depth + 1);
  }

  /// d light / ds
  Rgb rate(double s) const {
    const double passed = transmittance(depth_of_all(m_pieces, s));
    if (!(passed > 0.0)) return Rgb(0.0);
    Rgb sum(0.0);
    for (const FogPiece& piece : m_pieces) sum += source_at(piece, s) * (extinction_at(piece, s) * passed);
    return sum;
  }

  std::span<const FogPiece> m_pieces;
  double m_accuracy;
};

/// One of several pieces that begin at the same place: its own depths, their sum and what shows, at both ends
/// of a stretch.
struct PieceOfSeveral {
  double own0, own1, own_bend;
  double front, back, depth, bend;  ///< of all; depth: of the stretch
};

/// The range of integral T d(own depth). With both depths linear it is own front phi1(depth). T is within
/// exp(+-bend) of that; what the own depth is off, which is nothing at both ends, changes it by own_bend
/// times the loss of T at most. Besides, T falls from `front` to `back`, and no more is lost than all lose.
std::pair<double, double> share_of_loss(const PieceOfSeveral& piece) {
  const double own = piece.own1 - piece.own0, loss = piece.front - piece.back;
  double least = piece.back > 0.0 ? piece.back * own : 0.0, most = std::min(loss, piece.front * own);
  if (std::isfinite(own) && std::isfinite(piece.depth) && std::isfinite(piece.bend)) {
    const double middle = own * piece.front * phi1(piece.depth), off = piece.own_bend * loss;
    least = std::max(least, std::exp(-piece.bend) * (middle - off));
    most = std::min(most, std::exp(piece.bend) * (middle + off));
  }
  return {std::min(least, most), most};
}

bool have_closed_form(std::span<const FogPiece> pieces) {
  return pieces.size() == 1 || std::all_of(pieces.begin(), pieces.end(), is_homogeneous);
}

}  // namespace

double depth_of_all(std::span<const FogPiece> pieces, double s) {
  double sum = 0.0;
  for (const FogPiece& piece : pieces) sum += depth_to(piece, s);
  return sum;
}

Rgb light_of_all(std::span<const FogPiece> pieces, double s, double accuracy) {
  if (!(s > 0.0) && pieces.size() != 1) return Rgb(0.0);
  if (pieces.size() == 1) return light_to(pieces.front(), s);
  if (std::all_of(pieces.begin(), pieces.end(), is_homogeneous)) {
    double sigma = 0.0;
    Rgb sum(0.0);
    for (const FogPiece& piece : pieces) {
      sigma += piece.sigma;
      sum += piece.sigma * piece.colour;
    }
    return sigma > 0.0 ? (sum / sigma) * opacity_from_tau(sigma * s) : Rgb(0.0);
  }
  return OverlapQuadrature(pieces, accuracy).integrate(s);
}

std::vector<FogPiece>& FogOnRay::start() {
  m_pieces.clear();
  m_active.clear();
  m_spans.clear();
  return m_pieces;
}

void FogOnRay::finish(double t_end, double accuracy) {
  m_accuracy = accuracy;
  m_ends.clear();
  std::erase_if(m_pieces, [&](const FogPiece& piece) { return !(piece.t0 < piece.t1 && piece.t0 < t_end); });
  for (FogPiece& piece : m_pieces) {
    piece.t1 = std::min(piece.t1, t_end);
    m_ends.push_back(piece.t0);
    m_ends.push_back(piece.t1);
  }
  std::sort(m_ends.begin(), m_ends.end());
  m_ends.erase(std::unique(m_ends.begin(), m_ends.end()), m_ends.end());
  Veil before;
  double tau = 0.0;
  for (size_t e = 0; e + 1 < m_ends.size(); ++e) {
    Span span{m_ends[e], m_ends[e + 1], m_active.size(), 0, tau, before.light};
    for (const FogPiece& piece : m_pieces) {
      if (piece.t0 <= span.t0 && piece.t1 > span.t0) m_active.push_back(cut_before(piece, span.t0));
    }
    span.count = m_active.size() - span.first;
    if (span.count == 0) continue;
    before = to(span, span.t1);
    tau = tau_to(span, span.t1);
    m_spans.push_back(span);
  }
}

Veil FogOnRay::to(const Span& span, double t) const {
  const double front = transmittance(span.tau);
  if (!(front > 0.0)) return {0.0, span.light};
  const double s = std::min(t, span.t1) - span.t0;
  return {transmittance(tau_to(span, t)), span.light + front * light_of_all(pieces_of(span), s, m_accuracy)};
}

double FogOnRay::tau_to(const Span& span, double t) const {
  return span.tau + depth_of_all(pieces_of(span), std::min(t, span.t1) - span.t0);
}

/// The last span that begins at t or before; null in front of all fog.
const FogOnRay::Span* FogOnRay::span_of(double t) const {
  const auto after = std::upper_bound(m_spans.begin(), m_spans.end(), t,
                                      [](double x, const Span& span) { return x < span.t0; });
  return after == m_spans.begin() ? nullptr : &*(after - 1);
}

Veil FogOnRay::to(double t) const {
  const Span* span = span_of(t);
  return span ? to(*span, t) : Veil{};
}

double FogOnRay::tau_to(double t) const {
  const Span* span = span_of(t);
  return span ? tau_to(*span, t) : 0.0;
}

FogRange FogOnRay::between(double t0, double t1) const {
  FogRange range;
  const Span* span = span_of(t0);
  if (!span || t0 >= span->t1) return range;
  const std::span<const FogPiece> pieces = pieces_of(*span);
  const double s0 = t0 - span->t0, s1 = std::min(t1, span->t1) - span->t0;
  for (const FogPiece& piece : pieces) {
    range.bend += depth_bend(piece, s0, s1);
    for (const double s : {s0, s1}) {
      const Rgb gain = pieces.size() == 1 ? light_per_loss(piece, s) : source_at(piece, s);
      const bool is_first = &piece == pieces.data() && s == s0;
      for (int c = 0; c < 3; ++c) {
        range.least[c] = is_first ? gain[c] : std::min(range.least[c], gain[c]);
        range.most[c] = is_first ? gain[c] : std::max(range.most[c], gain[c]);
      }
    }
  }
  return range;
}

LightGrowth FogOnRay::growth(double t0, double t1) const {
  LightGrowth growth;
  const Span* span = span_of(t0);
  if (!span || t0 >= span->t1) return growth;
  const std::span<const FogPiece> pieces = pieces_of(*span);
  if (have_closed_form(pieces)) {
    growth.least = growth.most = to(*span, t1).light - to(*span, t0).light;
    return growth;
  }
  const double s0 = t0 - span->t0, s1 = std::min(t1, span->t1) - span->t0;
  const double depth0 = span->tau + depth_of_all(pieces, s0), depth1 = span->tau + depth_of_all(pieces, s1);
  if (!std::isfinite(depth0)) return growth;
  PieceOfSeveral of_all{0, 0, 0, transmittance(depth0), transmittance(depth1), depth1 - depth0, 0.0};
  for (const FogPiece& piece : pieces) of_all.bend += depth_bend(piece, s0, s1);
  for (const FogPiece& piece : pieces) {
    of_all.own0 = depth_to(piece, s0), of_all.own1 = depth_to(piece, s1);
    of_all.own_bend = depth_bend(piece, s0, s1);
    const auto [least, most] = share_of_loss(of_all);
    const Rgb source0 = source_at(piece, s0), source1 = source_at(piece, s1);
    for (int c = 0; c < 3; ++c) {
      const double dark = std::min(source0[c], source1[c]), bright = std::max(source0[c], source1[c]);
      growth.least[c] += dark * (dark >= 0.0 ? least : most);
      growth.most[c] += bright * (bright >= 0.0 ? most : least);
    }
  }
  return growth;
}

bool FogOnRay::has_closed_form() const {
  return std::all_of(m_spans.begin(), m_spans.end(),
                     [&](const Span& span) { return have_closed_form(pieces_of(span)); });
}

double FogOnRay::depth_inverse(double tau) const {
  for (const Span& span : m_spans) {
    const std::span<const FogPiece> pieces = pieces_of(span);
    const double wanted = tau - span.tau;
    if (wanted <= 0.0) return span.t0;
    // Where one piece alone reaches the depth, all together have reached it.
    double hi = span.t1 - span.t0, lo = 0.0;
    for (const FogPiece& piece : pieces) hi = std::min(hi, pileus::depth_inverse(piece, wanted));
    if (pieces.size() == 1 && hi < span.t1 - span.t0) return span.t0 + hi;
    if (!std::isfinite(hi)) {
      for (hi = 1.0; depth_of_all(pieces, hi) < wanted && hi < kFarthest;) hi *= 2.0;
    }
    if (depth_of_all(pieces, hi) < wanted) continue;
    while (hi - lo > 1e-14 * hi) {
      const double middle = 0.5 * (lo + hi);
      if (middle <= lo || middle >= hi) break;
      (depth_of_all(pieces, middle) < wanted ? lo : hi) = middle;
    }
    return span.t0 + hi;
  }
  return kInfinity;
}

std::vector<double> FogOnRay::edges() const {
  std::vector<double> found;
  for (const double t : m_ends) {
    if (t > 0.0 && std::isfinite(t)) found.push_back(t);
  }
  return found;
}

}  // namespace pileus
