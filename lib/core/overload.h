#pragma once

namespace pileus {

/// One callable made of several, for std::visit: std::visit(Overload{[](int) {…}, [](double) {…}}, variant).
template <class... Cases>
struct Overload : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Overload(Cases...) -> Overload<Cases...>;

}  // namespace pileus
