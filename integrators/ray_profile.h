#pragma once

#include <span>
#include <vector>

#include "lib/math/ray.h"
#include "lib/scene/world.h"

namespace pileus {

/// The extinction of all media along one ray, in closed form: the pieces of every medium, cut at each other's
/// ends so that within a span every medium is one cubic (or one exponential). Overlapping media add their
/// coefficients. Keeps its memory between rays.
class RayProfile {
 public:
  /// A stretch of the ray with at least one medium in it.
  struct Span {
    double t0, t1;    ///< [m]
    double tau0;      ///< optical depth from the start of the profile to t0
    double tau;       ///< optical depth of the span itself
    bool starts_run;  ///< true after a gap without media, or at a cut
  };

  /// Reads all media along the ray. `cuts` are further places where the integrand may jump: spans end there.
  void build(const World& world, const Ray& ray, Segment segment, std::span<const double> cuts,
             FieldCounters& counters);

  const std::vector<Span>& spans() const { return m_spans; }

  /// Optical depth of everything.
  double tau() const { return m_spans.empty() ? 0.0 : m_spans.back().tau0 + m_spans.back().tau; }

  /// Density of a medium at t, which lies in span i.
  double density(size_t i, size_t medium, double t) const {
    const DensityPiece* piece = piece_of(i, medium);
    return piece ? density_at(*piece, t) : 0.0;
  }

  /// Extinction of all media at t in span i [1/m].
  double sigma_t(size_t i, double t) const;

  /// Optical depth from the start of span i to t.
  double tau_to(size_t i, double t) const;

  /// The integral of a medium's density over span i [m].
  double column(size_t i, size_t medium) const;

  /// How many times a density of span i changes by the factor e, added up over the media; 0 where all are
  /// cubics.
  double exponential_rise(size_t i) const;

  /// The inverse of tau_to: where in span i the optical depth since its start reaches `tau`.
  double t_at(size_t i, double tau) const;

  /// What a medium is in span i, among other places; null where it is absent.
  const DensityPiece* piece_of(size_t i, size_t medium) const {
    const int index = m_piece_index[i * m_pieces.size() + medium];
    return index < 0 ? nullptr : &m_pieces[medium][size_t(index)];
  }

  /// True where only one medium fills span i; `medium` is then its index.
  bool is_single(size_t i, size_t& medium) const;

 private:
  void collect_ends(std::span<const double> cuts);
  void cut_into_spans(std::span<const double> cuts);

  std::vector<std::vector<DensityPiece>> m_pieces;  ///< of each medium
  std::vector<double> m_extinction;                 ///< of each medium
  std::vector<double> m_ends;                       ///< all ends of pieces and cuts, ascending
  std::vector<Span> m_spans;
  std::vector<int> m_piece_index;  ///< [span][medium]: index into m_pieces[medium], -1 where it is absent
};

}  // namespace pileus
