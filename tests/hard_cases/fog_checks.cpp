#include "lib/fog/fade.h"
#include "lib/fog/lit_layer.h"
#include "lib/math/compositor.h"
#include "tests/hard_cases/hard_cases.h"

namespace pileus::hard_cases {

void add_fog_checks(Checks& checks) {
  checks.add({"FOG-01", "FOG-04"}, []<class T>(T, const HardCase& row) {
    expect_values<T>(row, {exponential_fade(row.input<T>("d"), row.input<T>("rho"))});
  });
  checks.add({"FOG-02", "FOG-03"}, []<class T>(T, const HardCase& row) {
    expect_values<T>(row, {exponential_squared_fade(row.input<T>("d"), row.input<T>("rho"))});
  });
  checks.add({"FOG-05", "FOG-06"}, []<class T>(T, const HardCase& row) {
    std::vector<T> fades;
    for (const T d : row.inputs<T>("d")) {
      fades.push_back(linear_fade(d, row.input<T>("start"), row.input<T>("end")));
    }
    expect_values<T>(row, fades);
  });
  checks.add({"FOG-07", "FOG-08", "FOG-09", "FOG-10", "FOG-11", "FOG-12", "FOG-13", "FOG-14", "FOG-15",
              "FOG-16", "FOG-17", "FOG-18", "FOG-19"},
             []<class T>(T, const HardCase& row) {
               expect_values<T>(row, {lit_layer_light(row.input<T>("B"), row.input<T>("H"), row.input<T>("h"),
                                                      row.input<T>("sinAlpha"), row.input<T>("sinBeta"))});
             });
  checks.add({"FOG-20", "FOG-21"}, []<class T>(T, const HardCase& row) {
    const T sunlit = row.input<T>("Ic") * row.input<T>("R");
    expect_values<T>(row, {object_light_through_layer(row.input<T>("A"), sunlit, row.input<T>("B"),
                                                      row.input<T>("H"), row.input<T>("h"),
                                                      row.input<T>("sinAlpha"), row.input<T>("sinBeta"))});
  });
  checks.add({"FOG-22"}, []<class T>(T, const HardCase& row) {
    Compositor<T> compositor;
    for (int layer = 0; layer < 1500; ++layer) {
      compositor.add_segment(T(0.01) * row.input<T>("sigma"), {T(1), T(1), T(1)});
    }
    expect_values<T>(row, {compositor.radiance().x});
  });
}

}  // namespace pileus::hard_cases
