#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "lib/image/image.h"
#include "pileus/pileus.h"

namespace pileus {

/// The picture that errors are measured against: the integrator `exact` at a tolerance far below theirs.
struct AccuracyReference {
  Image image;  ///< R, G, B, A and error_estimate
  double tolerance = 0.0;
  double seconds = 0.0;             ///< that it took to build and render
  double max_error_estimate = 0.0;  ///< its own
  double rms_error_estimate = 0.0;  ///< an RMSE below it says nothing
  double rms_radiance = 0.0;        ///< root mean square of R, G and B
  bool is_reused = false;           ///< it came from an earlier run
};

/// Takes the reference from `folder`/reference.exr where that fits the scene, its files, the size and the
/// tolerance; else renders it and leaves it there. An empty folder keeps nothing. An interrupted reference is
/// gone on with.
AccuracyReference make_reference(const Scene& scene, double tolerance, const std::filesystem::path& folder,
                                 RenderOptions options);

/// What an integrator says of its own error, against the error that it has.
struct OwnError {
  double max = 0.0, mean = 0.0;
  /// Median over the pixels of said / true error, of those whose true error the reference resolves.
  std::optional<double> effectivity;
  /// Pixels whose true error is larger than said by more than the reference and 32-bit storage may be off.
  size_t exceeded = 0;
};

/// Judges the plane "error_estimate" or "error_bound" of a picture; none where it has no such plane, or no
/// number in it.
std::optional<OwnError> judge_own_error(const Image& picture, const char* plane,
                                        const AccuracyReference& reference);

/// The true error per pixel: the largest of its channels' absolute errors. NaN where it cannot be compared.
std::vector<float> true_errors(const Image& picture, const Image& reference);

}  // namespace pileus
