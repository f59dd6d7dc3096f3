// Runs every row of the catalogue that has a check, in binary32 and in binary64, and refuses rows that
// neither have one nor a reason for its absence.
#include "tests/hard_cases/hard_cases.h"

#include <algorithm>

namespace pileus::hard_cases {
namespace {

const Checks& checks() {
  static const Checks all = [] {
    Checks made;
    add_opacity_checks(made);
    add_compositing_checks(made);
    add_fog_checks(made);
    add_phase_checks(made);
    add_roots_checks(made);
    add_forms_checks(made);
    add_trilinear_checks(made);
    add_shading_checks(made);
    add_terrain_checks(made);
    return made;
  }();
  return all;
}

/// Rows without a check here, by id or by the group before the dash.
const std::map<std::string, std::string>& unchecked() {
  static const std::map<std::string, std::string> reasons{
      {"HMP-01", "rays descend the pyramid from its top: no level is chosen by the length of a footprint"},
      {"HMP-06", "heights are bilinear"},
      {"HMP-08", "a block is judged as a whole: no footprint ever straddles blocks"},
      {"OCT", "opacities are never averaged over an octree: OCT-08 shows the bias"},
      {"DDA", "not a matter of arithmetic alone: belongs to the traversal of grids"},
      {"RAD", "not a matter of arithmetic alone: belongs to the integrators"},
      {"ROO-28", "no quartic is ever solved: there is no torus"},
      {"TRI-05", "densities are clamped when grids are built, never along a ray"},
      {"TRI-13",
       "extinction and source are never both linear in distance: sources are linear in optical depth"},
      {"PRJ-01", "no depth is ever formed in post-projective space"},
      {"PRJ-02", "no depth is ever formed in post-projective space"},
      {"PRJ-03", "no depth is ever formed in post-projective space"},
      {"SHD-03", "media are not shaded by the gradient of their density"},
  };
  return reasons;
}

std::string group_of(const std::string& id) {
  return id.substr(0, id.find('-'));
}

TEST(HardCases, every_row_is_checked_or_excused) {
  for (const HardCase& row : all_cases()) {
    const bool is_checked = checks().by_id().contains(row.id);
    const bool is_excused = unchecked().contains(row.id) || unchecked().contains(group_of(row.id));
    EXPECT_TRUE(is_checked || is_excused) << row.id << " has neither a check nor a reason";
    EXPECT_FALSE(is_checked && is_excused) << row.id << " has a check: drop the reason";
  }
}

TEST(HardCases, every_check_and_reason_has_its_row) {
  const auto has_row = [](const std::string& key) {
    return std::any_of(all_cases().begin(), all_cases().end(),
                       [&](const HardCase& row) { return row.id == key || group_of(row.id) == key; });
  };
  for (const auto& [id, check] : checks().by_id()) EXPECT_TRUE(has_row(id)) << id;
  for (const auto& [key, reason] : unchecked()) EXPECT_TRUE(has_row(key)) << key;
}

TEST(HardCases, the_catalogue_is_whole) {
  EXPECT_EQ(all_cases().size(), 167u);
}

class HardCaseTest : public testing::TestWithParam<HardCase> {
 public:
  template <std::floating_point T>
  static void run() {
    checks().by_id().at(GetParam().id).template of<T>()(GetParam());
  }
};
struct Binary32 : HardCaseTest {};
struct Binary64 : HardCaseTest {};

TEST_P(Binary32, holds) {
  run<float>();
}
TEST_P(Binary64, holds) {
  run<double>();
}

/// The rows that have a check and an expected value in this precision.
template <std::floating_point T>
std::vector<HardCase> checked_cases() {
  std::vector<HardCase> result;
  for (const HardCase& row : all_cases()) {
    if (checks().by_id().contains(row.id) && row.has<T>()) result.push_back(row);
  }
  return result;
}

std::string test_name(const testing::TestParamInfo<HardCase>& info) {
  std::string name = info.param.id;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(HardCases, Binary32, testing::ValuesIn(checked_cases<float>()), test_name);
INSTANTIATE_TEST_SUITE_P(HardCases, Binary64, testing::ValuesIn(checked_cases<double>()), test_name);

}  // namespace

/// Spares GoogleTest the bytes of the row.
void PrintTo(const HardCase& row, std::ostream* out) {
  *out << row.id;
}

}  // namespace pileus::hard_cases
