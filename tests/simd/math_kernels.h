#pragma once

#include <cstdint>
#include <span>

namespace pileus {

// The shared pieces of the kernels, over arrays of any length. One call works in whole vectors; the last one
// is padded.

void transmittances(std::span<const float> tau, std::span<float> result);
void opacities(std::span<const float> tau, std::span<float> result);

/// Cells whose lowest corner is values[index], strides as in a brick; reads 82 + 9 + 1 values beyond it.
void trilinears(const float* values, std::span<const int32_t> index, std::span<const float> x,
                std::span<const float> y, std::span<const float> z, std::span<float> result);

/// The same for 16-bit values; results in steps of these.
void quantized_trilinears(const int16_t* values, std::span<const int32_t> index, std::span<const float> x,
                          std::span<const float> y, std::span<const float> z, std::span<float> result);

/// Name of the instruction set in use.
const char* math_target();

}  // namespace pileus
