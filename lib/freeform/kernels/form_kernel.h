#pragma once

#include <cstddef>
#include <span>

namespace pileus {

class LocalForm;

/// Offsets from a form's anchor, padded to whole vectors.
struct FormPoints {
  static constexpr size_t kMost = 256;  ///< coordinates and values stay in the first cache

  size_t count = 0;
  alignas(64) float x[kMost] = {}, y[kMost] = {}, z[kMost] = {};
};

/// The form at some points; f has points.count places.
void evaluate_points(const LocalForm& form, const FormPoints& points, std::span<float> f);

/// Name of the instruction set in use.
const char* form_target();

}  // namespace pileus
