#include <half.h>

#include "lib/math/compositor.h"
#include "tests/hard_cases/hard_cases.h"

namespace pileus::hard_cases {
namespace {

template <class T>
using Colour = Imath::Vec3<T>;

/// Runs n segments with the opacity omega each and no source.
template <class T>
T transmittance_after(int n, T omega) {
  Compositor<T> compositor;
  for (int i = 0; i < n; ++i) compositor.add_segment(extinction_from_opacity(omega), Colour<T>(0));
  return compositor.transmittance();
}

/// T *= 1 - omega in binary16, every value rounded to it.
float half_transmittance_after(int n, float omega) {
  const Imath::half factor = 1.0F - omega;
  Imath::half transmittance = 1.0F;
  for (int i = 0; i < n; ++i) transmittance *= factor;
  return transmittance;
}

/// The same in 8 bits.
int byte_transmittance_after(int n, float omega) {
  int transmittance = 255;
  for (int i = 0; i < n; ++i) transmittance = int(std::lround(float(transmittance) * (1.0F - omega)));
  return transmittance;
}

/// Front to back until done: the number of segments, and the colour of their source 1.
template <class T>
std::pair<int, T> composite_until_done(int n, T omega, T stop) {
  Compositor<T> compositor(stop);
  int steps = 0;
  for (; steps < n && !compositor.done(); ++steps) {
    compositor.add_segment(extinction_from_opacity(omega), Colour<T>(1));
  }
  return {steps, compositor.radiance().x};
}

}  // namespace

void add_compositing_checks(Checks& checks) {
  const auto equal_steps = [](int n) {
    return [n]<class T>(T, const HardCase& row) {
      expect_values<T>(row, {transmittance_after(n, row.input<T>("Omega"))});
    };
  };
  checks.add({"CMP-01"}, equal_steps(100000));
  checks.add({"CMP-02", "CMP-03"}, equal_steps(10000));
  checks.add({"CMP-04"}, equal_steps(4096));

  checks.add({"CMP-05"}, []<class T>(T, const HardCase& row) {
    const T tau_a = extinction_from_opacity(row.input<T>("Omega_a"));
    const T tau_b = extinction_from_opacity(row.input<T>("Omega_b"));
    Compositor<T> compositor;
    for (int i = 0; i < 2048; ++i) {
      compositor.add_segment(tau_a, Colour<T>(1));
      compositor.add_segment(tau_b, Colour<T>(0));
    }
    expect_values<T>(row, {compositor.radiance().x});
  });

  checks.add({"CMP-06"}, []<class T>(T, const HardCase& row) {
    NeumaierSum<T> sum;
    for (int i = 0; i < 1'000'000; ++i) sum.add(row.input<T>("x"));
    expect_values<T>(row, {sum.value()});
  });

  checks.add({"CMP-07"}, []<class T>(T, const HardCase& row) {
    const T zeta = row.input<T>("zeta");
    const int n = int(row.input<T>("N"));
    const auto [steps, colour] = composite_until_done(n, row.input<T>("Omega"), zeta);
    const auto [all_steps, full_colour] = composite_until_done(n, row.input<T>("Omega"), T(0));
    EXPECT_EQ(steps, int(row.expected("steps")));
    EXPECT_EQ(all_steps, n);
    const auto near = [&](T got, const char* name) {
      EXPECT_NEAR(got, row.expected(name), row.tolerance<T>(0)) << name;
    };
    near(colour, "colour");
    near(full_colour, "full_colour");
    near(full_colour - colour, "discarded");
    EXPECT_LE(full_colour - colour, zeta);
  });

  checks.add({"CMP-08"}, []<class T>(T, const HardCase& row) {
    const int n = int(row.input<T>("N"));
    const float omega = row.input<float>("Omega");
    EXPECT_NEAR(transmittance_after(n, row.input<T>("Omega")), row.expected("exact"), row.tolerance<T>(0));
    EXPECT_NEAR(half_transmittance_after(n, omega), row.expected("binary16"), row.tolerance<T>(0));
    EXPECT_EQ(byte_transmittance_after(n, omega), 255);  // never moves: expected 1
  });

  checks.add({"CMP-09"}, []<class T>(T, const HardCase& row) {
    Compositor<T> compositor;
    for (const T omega : row.inputs<T>("Omega")) {
      compositor.add_segment(extinction_from_opacity(omega), Colour<T>(0));
    }
    EXPECT_EQ(compositor.transmittance(), T(row.expected("T")));
  });
}

}  // namespace pileus::hard_cases
