#include "integrators/ray_profile.h"

#include <algorithm>
#include <cmath>

namespace pileus {

void RayProfile::build(const World& world, const Ray& ray, Segment segment, std::span<const double> cuts,
                       FieldCounters& counters) {
  m_pieces.resize(world.media.size());
  m_extinction.resize(world.media.size());
  for (size_t medium = 0; medium < world.media.size(); ++medium) {
    m_extinction[medium] = world.media[medium].extinction;
    m_pieces[medium].clear();
    world.media[medium].density->append_pieces(ray, segment, m_pieces[medium], counters);
  }
  m_cuts.assign(cuts.begin(), cuts.end());
  cut_at_edges(world);
  collect_ends(m_cuts);
  cut_into_spans(m_cuts);
}

/// A medium that is no grid may have an edge: where it lies in another medium, the mean source jumps there.
void RayProfile::cut_at_edges(const World& world) {
  if (world.media.size() < 2) return;
  for (size_t medium = 0; medium < world.media.size(); ++medium) {
    if (world.media[medium].density->has_bricks()) continue;
    for (const DensityPiece& piece : m_pieces[medium]) {
      m_cuts.push_back(piece.t0);
      m_cuts.push_back(piece.t1);
    }
  }
}

void RayProfile::collect_ends(std::span<const double> cuts) {
  m_ends.assign(cuts.begin(), cuts.end());
  for (const auto& pieces : m_pieces) {
    for (const DensityPiece& piece : pieces) {
      m_ends.push_back(piece.t0);
      m_ends.push_back(piece.t1);
    }
  }
  std::sort(m_ends.begin(), m_ends.end());
  m_ends.erase(std::unique(m_ends.begin(), m_ends.end()), m_ends.end());
}

void RayProfile::cut_into_spans(std::span<const double> cuts) {
  const size_t media = m_pieces.size();
  m_spans.clear();
  m_piece_index.clear();
  std::vector<size_t> next(media, 0);  // the first piece of each medium that has not ended yet
  double tau = 0.0;
  for (size_t e = 0; e + 1 < m_ends.size(); ++e) {
    const double t0 = m_ends[e], t1 = m_ends[e + 1];
    bool is_filled = false;
    for (size_t medium = 0; medium < media; ++medium) {
      const auto& pieces = m_pieces[medium];
      while (next[medium] < pieces.size() && pieces[next[medium]].t1 <= t0) ++next[medium];
      const bool is_here = next[medium] < pieces.size() && pieces[next[medium]].t0 <= t0;
      m_piece_index.push_back(is_here ? int(next[medium]) : -1);
      is_filled |= is_here;
    }
    if (!is_filled) {
      m_piece_index.resize(m_piece_index.size() - media);
      continue;
    }
    const bool after_gap = m_spans.empty() || m_spans.back().t1 < t0;
    const bool at_cut = std::find(cuts.begin(), cuts.end(), t0) != cuts.end();
    m_spans.push_back({t0, t1, tau, 0.0, after_gap || at_cut});
    m_spans.back().tau = tau_to(m_spans.size() - 1, t1);
    tau += m_spans.back().tau;
  }
}

double RayProfile::sigma_t(size_t i, double t) const {
  double sum = 0.0;
  for (size_t medium = 0; medium < m_pieces.size(); ++medium)
    sum += m_extinction[medium] * density(i, medium, t);
  return sum;
}

double RayProfile::tau_to(size_t i, double t) const {
  double sum = 0.0;
  for (size_t medium = 0; medium < m_pieces.size(); ++medium) {
    if (const DensityPiece* piece = piece_of(i, medium)) {
      sum += m_extinction[medium] * (column_to(*piece, t) - column_to(*piece, m_spans[i].t0));
    }
  }
  return sum;
}

double RayProfile::column(size_t i, size_t medium) const {
  const DensityPiece* piece = piece_of(i, medium);
  return piece ? column_to(*piece, m_spans[i].t1) - column_to(*piece, m_spans[i].t0) : 0.0;
}

double RayProfile::exponential_rise(size_t i) const {
  double sum = 0.0;
  for (size_t medium = 0; medium < m_pieces.size(); ++medium) {
    if (const DensityPiece* piece = piece_of(i, medium)) {
      sum += std::abs(piece->rate) * (m_spans[i].t1 - m_spans[i].t0);
    }
  }
  return sum;
}

double RayProfile::t_at(size_t i, double tau) const {
  const Span& span = m_spans[i];
  double lo = span.t0, hi = span.t1;
  if (tau <= 0.0) return lo;
  if (tau >= span.tau) return hi;
  const double precision = 1e-13 * (hi - lo);
  double t = lo + (hi - lo) * (tau / span.tau);
  for (int step = 0; step < 64 && hi - lo > precision; ++step) {
    const double excess = tau_to(i, t) - tau;
    (excess > 0.0 ? hi : lo) = t;
    const double newton = t - excess / sigma_t(i, t);
    const double next = newton > lo && newton < hi ? newton : 0.5 * (lo + hi);
    if (std::abs(next - t) <= precision) return next;
    t = next;
  }
  return t;
}

bool RayProfile::is_single(size_t i, size_t& medium) const {
  int count = 0;
  for (size_t m = 0; m < m_pieces.size(); ++m) {
    if (!piece_of(i, m)) continue;
    medium = m;
    ++count;
  }
  return count == 1;
}

}  // namespace pileus
