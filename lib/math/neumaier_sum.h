#pragma once

#include <cmath>
#include <concepts>

namespace pileus {

/// A sum that carries what rounding takes from it. Neumaier's scheme, with the carry folded back at every
/// step: left to grow on its own, the carry of a million equal terms loses digits itself. For terms >= 0 the
/// error is at most u + n u^2 of the sum, where a plain sum of n terms may lose n u. Infinities add as usual.
/// ref: Neumaier 1974; Higham 2002, Accuracy and stability of numerical algorithms, ch. 4
template <std::floating_point T>
class NeumaierSum {
 public:
  void add(T term) {
    const T sum = m_sum + term;
    if (!std::isfinite(sum)) {  // and stays so: there is nothing left to carry
      m_sum = sum;
      m_carry = 0;
      return;
    }
    const T lost = std::abs(m_sum) >= std::abs(term) ? (m_sum - sum) + term : (term - sum) + m_sum;
    const T carry = m_carry + lost;
    m_sum = sum + carry;
    m_carry = carry - (m_sum - sum);
  }

  T value() const { return m_sum; }

 private:
  T m_sum = 0;
  T m_carry = 0;  ///< to be added to m_sum, at most half an ulp of it
};

}  // namespace pileus
