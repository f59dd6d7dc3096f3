#pragma once

#include <cmath>
#include <concepts>

namespace pileus {

/// A sum that carries its own rounding error (Neumaier 1974): the error of the result is about 2 u of it plus
/// n u^2 of the sum of magnitudes, where a plain sum of n terms loses n u. Infinities add as usual.
template <std::floating_point T>
class NeumaierSum {
 public:
  void add(T term) {
    const T sum = m_sum + term;
    m_lost += std::abs(m_sum) >= std::abs(term) ? (m_sum - sum) + term : (term - sum) + m_sum;
    m_sum = sum;
  }

  /// Once the sum is infinite, what was lost is no number.
  T value() const { return std::isfinite(m_sum) ? m_sum + m_lost : m_sum; }

 private:
  T m_sum = 0;
  T m_lost = 0;
};

}  // namespace pileus
