#include "lib/terrain/height_field.h"
#include "tests/hard_cases/hard_cases.h"

namespace pileus::hard_cases {

void add_terrain_checks(Checks& checks) {
  checks.add({"HMP-02"}, []<class T>(T, const HardCase& row) {
    expect_values<T>(row, {Patch<T>{1, 2, 3, 5}.at(row.input<T>("u"), row.input<T>("v"))});
  });
  checks.add({"HMP-03"}, []<class T>(T, const HardCase& row) {
    expect_values<T>(row, {Patch<T>{5, 5, 5, 5}.at(T(0.25), T(0.5))});
  });
  checks.add({"HMP-04"}, []<class T>(T, const HardCase& row) {
    const std::vector<T> z = row.inputs<T>("row");
    const MapCell<T> end = map_cell(row.input<T>("u"), 1);
    EXPECT_EQ(end.cell, 0);
    expect_values<T>(row, {Patch<T>{z[0], z[1], z[0], z[1]}.at(end.fraction, T(0))});
  });
  checks.add({"HMP-05"}, []<class T>(T, const HardCase& row) {
    const MapCell<T> place = map_cell(row.input<T>("u"));
    EXPECT_EQ(place.cell, row.expected("cell"));
    EXPECT_EQ(place.fraction, row.expected("fraction"));
  });
  checks.add({"HMP-07"}, []<class T>(T, const HardCase& row) {
    const HeightPyramid pyramid(HeightTable{4, 2, {0, 0, 5, 0, 0, 0, 5, 0}});
    const std::vector<long double> expected = row.expected_list("conservative_level1");
    for (int i = 0; i < 2; ++i) EXPECT_EQ(pyramid.at(1, i, 0).greatest, expected[size_t(i)]);
  });
}

}  // namespace pileus::hard_cases
