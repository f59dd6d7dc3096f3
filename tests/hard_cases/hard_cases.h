#pragma once

#include <cmath>
#include <concepts>
#include <cstdlib>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

// The catalogue of hard cases (METHODS 16). Inputs are decimal literals, rounded to the precision under test
// before use; the expected value belongs to the rounded inputs, hence one per precision.

namespace pileus::hard_cases {

template <std::floating_point T>
constexpr const char* kFormat = std::is_same_v<T, float> ? "binary32" : "binary64";

/// A decimal literal, or a fraction of two, rounded once to T.
template <std::floating_point T>
T parse(const std::string& literal) {
  const size_t slash = literal.find('/');
  if (slash != std::string::npos)
    return parse<T>(literal.substr(0, slash)) / parse<T>(literal.substr(slash + 1));
  if constexpr (std::is_same_v<T, float>) return std::strtof(literal.c_str(), nullptr);
  if constexpr (std::is_same_v<T, double>) return std::strtod(literal.c_str(), nullptr);
  if constexpr (std::is_same_v<T, long double>) return std::strtold(literal.c_str(), nullptr);
}

struct HardCase {
  std::string id, group;
  nlohmann::json row;

  template <std::floating_point T>
  T input(const char* name) const {
    return number<T>(row.at("inputs").at(name));
  }

  template <std::floating_point T>
  std::vector<T> inputs(const char* name) const {
    return numbers<T>(row.at("inputs").at(name));
  }

  /// False where the row holds for the other precision only.
  template <std::floating_point T>
  bool has() const {
    const nlohmann::json& expected = row.at("expected");
    return !is_per_format(expected) || expected.contains(kFormat<T>);
  }

  /// The expected values for inputs rounded to T.
  template <std::floating_point T>
  std::vector<long double> expected() const {
    const nlohmann::json& expected = row.at("expected");
    return numbers<long double>(is_per_format(expected) ? expected.at(kFormat<T>) : expected);
  }

  /// One of several expected values with names.
  long double expected(const char* name) const { return number<long double>(row.at("expected").at(name)); }
  std::vector<long double> expected_list(const char* name) const {
    return numbers<long double>(row.at("expected").at(name));
  }

  /// How far a result may lie from `expected`.
  template <std::floating_point T>
  long double tolerance(long double expected) const {
    const nlohmann::json& limits = row.at("tolerance");
    const std::string ulps = std::string(kFormat<T>) + "_ulp";
    if (limits.contains(ulps)) return limits.at(ulps).get<long double>() * ulp(static_cast<T>(expected));
    if (limits.contains("abs")) return limits.at("abs").get<long double>();
    return limits.at("rel").get<long double>() * std::abs(expected);
  }

 private:
  static bool is_per_format(const nlohmann::json& expected) {
    return expected.is_object() && (expected.contains("binary32") || expected.contains("binary64"));
  }

  template <std::floating_point T>
  static T number(const nlohmann::json& value) {
    return value.is_string() ? parse<T>(value.get<std::string>()) : value.get<T>();
  }

  template <std::floating_point T>
  static std::vector<T> numbers(const nlohmann::json& value) {
    if (!value.is_array()) return {number<T>(value)};
    std::vector<T> result;
    for (const nlohmann::json& item : value) result.push_back(number<T>(item));
    return result;
  }

  template <std::floating_point T>
  static long double ulp(T x) {
    const T magnitude = std::abs(x);
    return static_cast<long double>(std::nextafter(magnitude, std::numeric_limits<T>::infinity())) -
           magnitude;
  }
};

/// Every row of hard_cases.json, in its order.
const std::vector<HardCase>& all_cases();

/// Compares results with the row's expected values, count and order included.
template <std::floating_point T>
void expect_values(const HardCase& row, const std::vector<T>& got) {
  const std::vector<long double> expected = row.expected<T>();
  ASSERT_EQ(got.size(), expected.size());
  for (size_t i = 0; i < got.size(); ++i) {
    EXPECT_NEAR(got[i], expected[i], row.tolerance<T>(expected[i])) << "value " << i;
  }
}

/// What a row demands, for each precision.
struct Check {
  std::function<void(const HardCase&)> binary32, binary64;

  template <std::floating_point T>
  const auto& of() const {
    if constexpr (std::is_same_v<T, float>) return binary32;
    if constexpr (std::is_same_v<T, double>) return binary64;
  }
};

/// Checks by row id.
class Checks {
 public:
  /// `check(zero, row)` is generic in the type of zero, the precision under test.
  template <class Generic>
  void add(std::initializer_list<const char*> ids, Generic check) {
    for (const char* id : ids) {
      const bool is_new = m_by_id
                              .emplace(id, Check{[check](const HardCase& row) { check(0.0F, row); },
                                                 [check](const HardCase& row) { check(0.0, row); }})
                              .second;
      if (!is_new) ADD_FAILURE() << id << " has two checks";
    }
  }

  const std::map<std::string, Check>& by_id() const { return m_by_id; }

 private:
  std::map<std::string, Check> m_by_id;
};

// One file each.
void add_opacity_checks(Checks& checks);
void add_compositing_checks(Checks& checks);
void add_fog_checks(Checks& checks);
void add_phase_checks(Checks& checks);
void add_roots_checks(Checks& checks);
void add_forms_checks(Checks& checks);
void add_trilinear_checks(Checks& checks);
void add_shading_checks(Checks& checks);
void add_terrain_checks(Checks& checks);

}  // namespace pileus::hard_cases
