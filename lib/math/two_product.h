#pragma once

#include <concepts>
#include <limits>

namespace pileus {

/// A product and what rounding took from it: value + error is a * b exactly.
template <std::floating_point T>
struct TwoProduct {
  T value;
  T error;
};

/// Dekker's product. It needs no fused multiply-add, which the baseline of x86-64 lacks, and gives the same
/// bits as one. Exact unless a partial product over- or underflows: keep factors near 1.
/// ref: Dekker 1971, A floating-point technique for extending the available precision
template <std::floating_point T>
constexpr TwoProduct<T> two_product(T a, T b) {
  // Splits a number into two halves whose products are exact.
  constexpr T kSplitter = static_cast<T>((1LL << ((std::numeric_limits<T>::digits + 1) / 2)) + 1);
  const T a_big = kSplitter * a - (kSplitter * a - a);
  const T b_big = kSplitter * b - (kSplitter * b - b);
  const T a_small = a - a_big;
  const T b_small = b - b_big;
  const T value = a * b;
  const T error = ((a_big * b_big - value) + a_big * b_small + a_small * b_big) + a_small * b_small;
  return {value, error};
}

}  // namespace pileus
