#pragma once

#include <limits>
#include <span>
#include <vector>

#include "lib/fog/fog_piece.h"
#include "lib/math/vec.h"

namespace pileus {

/// What fog makes of the radiance L that a ray shows at some distance: transmittance * L + light.
struct Veil {
  double transmittance = 1.0;
  Rgb light{0.0};

  Rgb over(const Rgb& behind) const { return transmittance * behind + light; }
};

/// What is known of fog between two places of a ray.
struct FogRange {
  double bend = 0.0;          ///< its optical depth is within this of linear; may be infinite
  Rgb least{0.0}, most{0.0};  ///< what its light grows by, per transmittance that is lost
};

/// What light may grow by.
struct LightGrowth {
  Rgb least{0.0}, most{0.0};
};

/// All fog along one ray. Where fogs overlap, extinctions add up and each shows its colour by its share:
///   tau(t) = sum of tau_i(t),  light(t) = integral from 0 to t of sum_i sigma_i c_i exp(-tau) ds
/// Closed form where one piece is alone or all are homogeneous; else quadrature to the accuracy asked for.
/// Keeps its memory between rays.
class FogOnRay {
 public:
  /// Forgets the ray before. pieces(): to be filled with those of the new one, in any order; then finish().
  std::vector<FogPiece>& start();

  ///   t_end:    nothing behind it is asked for; may be infinite
  ///   accuracy: of the light, relative to the brightest source; > 0
  void finish(double t_end, double accuracy);

  /// What stands between the start of the ray and t, t <= t_end. The light is accurate to `accuracy`,
  /// the transmittance to rounding.
  Veil to(double t) const;

  /// Optical depth of all fog up to t.
  double tau_to(double t) const;

  /// Between t0 and t1, with no edge between them.
  FogRange between(double t0, double t1) const;

  /// By how much the light of the fog grows from t0 to t1, with no edge between them: a proven range, narrow
  /// where the stretch is short, and exact in closed form.
  LightGrowth growth(double t0, double t1) const;

  /// False where fogs overlap whose light is a quadrature.
  bool has_closed_form() const;

  /// The inverse: where on the ray the optical depth of all fog reaches tau; +inf where it does not.
  double depth_inverse(double tau) const;

  /// Ends of pieces in (0, t_end), ascending: between them the veil is smooth.
  std::vector<double> edges() const;

  bool empty() const { return m_spans.empty(); }

 private:
  /// A stretch on which the same pieces act; those are cut to begin with it.
  struct Span {
    double t0, t1;
    size_t first, count;  ///< into m_active
    double tau;           ///< before it
    Rgb light;            ///< from before it
  };

  std::span<const FogPiece> pieces_of(const Span& span) const {
    return std::span(m_active).subspan(span.first, span.count);
  }
  const Span* span_of(double t) const;
  double tau_to(const Span& span, double t) const;
  Veil to(const Span& span, double t) const;

  std::vector<FogPiece> m_pieces, m_active;
  std::vector<double> m_ends;
  std::vector<Span> m_spans;
  double m_accuracy = 1e-6;
};

/// Optical depth of several pieces that begin at the same place, and their light, over s metres.
double depth_of_all(std::span<const FogPiece> pieces, double s);
Rgb light_of_all(std::span<const FogPiece> pieces, double s, double accuracy);

}  // namespace pileus
