#include "lib/math/transmittance.h"
#include "tests/hard_cases/hard_cases.h"

namespace pileus::hard_cases {

void add_opacity_checks(Checks& checks) {
  checks.add({"OPA-01", "OPA-02", "OPA-03", "OPA-04", "OPA-05", "OPA-06", "OPA-07", "OPA-08", "OPA-09",
              "OPA-10", "OPA-11", "OPA-12"},
             []<class T>(T, const HardCase& row) {
               expect_values<T>(row, {opacity(row.input<T>("Omega"), row.input<T>("L"))});
             });
  checks.add({"OPA-13"}, []<class T>(T, const HardCase& row) {
    expect_values<T>(row, {opacity_from_tau(row.input<T>("tau"))});
  });
  checks.add({"OPA-14", "OPA-15"}, []<class T>(T, const HardCase& row) {
    expect_values<T>(row, {transmittance(row.input<T>("tau"))});
  });
  checks.add({"OPA-16"}, []<class T>(T, const HardCase& row) {
    expect_values<T>(row, {extinction_from_opacity(row.input<T>("Omega"))});
  });
}

}  // namespace pileus::hard_cases
