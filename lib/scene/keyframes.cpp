#include "lib/scene/keyframes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "lib/scene/param_reader.h"

namespace pileus {
namespace {

std::optional<double> number_of(const toml::node& node) {
  if (const auto* integer = node.as_integer()) return double(integer->get());
  if (const auto* real = node.as_floating_point()) return real->get();
  return std::nullopt;
}

bool is_keyframed(const toml::node& node) {
  const toml::table* table = node.as_table();
  return table && table->contains("times") && table->contains("values") &&
         table->size() == (table->contains("interpolation") ? 3 : 2);
}

/// Numbers in the same places of both.
bool are_alike(const toml::node& a, const toml::node& b) {
  if (!a.is_array() || !b.is_array()) return number_of(a) && number_of(b);
  const toml::array &x = *a.as_array(), &y = *b.as_array();
  if (x.size() != y.size()) return false;
  for (size_t i = 0; i < x.size(); ++i) {
    if (!are_alike(x[i], y[i])) return false;
  }
  return true;
}

/// A number that stands where `place` stands. Only the parser gives nodes a position, so it is let find one.
toml::table number_at(double number, const toml::source_region& place) {
  const std::string_view key = "v=";
  const size_t line = std::max<size_t>(place.begin.line, 1), column = std::max<size_t>(place.begin.column, 3);
  const std::string text = std::string(line - 1, '\n') + std::string(column - 1 - key.size(), ' ') +
                           std::string(key) + fmt::format("{:#.17g}", number);
  return toml::parse(text, place.path ? *place.path : std::string());
}

/// Puts a new number where `parent` holds an old one, under a key or an index.
void replace_number(toml::table& parent, const toml::key& key, toml::node&& number) {
  parent.insert_or_assign(key, std::move(number));
}
void replace_number(toml::array& parent, size_t index, toml::node&& number) {
  parent.replace(parent.cbegin() + std::ptrdiff_t(index), std::move(number));
}

/// One key of a number, or none beyond the first and the last.
struct Key {
  double time, value;
};

/// The slope of the smooth curve at `key`: none at the ends and where the values turn, else the weighted
/// harmonic mean of the slopes on both sides. No curve between two keys then leaves their values.
/// ref: F. N. Fritsch, J. Butland: A method for constructing local monotone piecewise cubic interpolants,
/// 1984.
double smooth_slope(const std::optional<Key>& before, const Key& key, const std::optional<Key>& after) {
  if (!before || !after) return 0.0;
  const double h0 = key.time - before->time, h1 = after->time - key.time;
  const double d0 = (key.value - before->value) / h0, d1 = (after->value - key.value) / h1;
  if (!(d0 * d1 > 0.0)) return 0.0;
  const double w0 = h0 + 2.0 * h1, w1 = 2.0 * h0 + h1;
  return (w0 + w1) / (w0 / d0 + w1 / d1);
}

/// The keys around a frame: the frame lies between keys[1] and keys[2].
using KeysAround = std::array<std::optional<Key>, 4>;

double linear_between(const KeysAround& keys, double frame) {
  const Key &from = *keys[1], &to = *keys[2];
  return from.value + (frame - from.time) / (to.time - from.time) * (to.value - from.value);
}

/// Cubic Hermite between the two keys.
double smooth_between(const KeysAround& keys, double frame) {
  const Key &from = *keys[1], &to = *keys[2];
  const double h = to.time - from.time, s = (frame - from.time) / h, r = 1.0 - s;
  const double m0 = smooth_slope(keys[0], from, keys[2]), m1 = smooth_slope(keys[1], to, keys[3]);
  return from.value + (to.value - from.value) * s * s * (3.0 - 2.0 * s) + h * s * r * (r * m0 - s * m1);
}

/// The nodes that stand in one place of the values around a frame; null beyond the first and the last.
using NodesAround = std::array<const toml::node*, 4>;

/// Interpolates between values[1], which is parent[place], and values[2], number by number; the result is
/// left in that place.
class Interpolator {
 public:
  Interpolator(const std::array<double, 4>& times, double frame, bool is_smooth)
      : m_times(times), m_frame(frame), m_is_smooth(is_smooth) {}

  template <class Parent, class Place>
  void blend(Parent& parent, const Place& place, toml::node& at, const NodesAround& values) const {
    if (toml::array* array = at.as_array()) {
      for (size_t i = 0; i < array->size(); ++i) blend(*array, i, (*array)[i], elements(values, i));
      return;
    }
    KeysAround keys;
    for (size_t k = 0; k < keys.size(); ++k) {
      if (values[k]) keys[k] = Key{m_times[k], *number_of(*values[k])};
    }
    if (keys[1]->value == keys[2]->value) return;
    const double number = m_is_smooth ? smooth_between(keys, m_frame) : linear_between(keys, m_frame);
    toml::table blended = number_at(number, at.source());
    replace_number(parent, place, std::move(*blended.get("v")));
  }

 private:
  static NodesAround elements(const NodesAround& values, size_t index) {
    NodesAround result{};
    for (size_t k = 0; k < values.size(); ++k) {
      if (values[k]) result[k] = &(*values[k]->as_array())[index];
    }
    return result;
  }

  std::array<double, 4> m_times;
  double m_frame;
  bool m_is_smooth;
};

class KeyframeResolver {
 public:
  KeyframeResolver(double frame, const std::string& file) : m_frame(frame), m_file(file) {}

  void resolve(toml::node& node) {
    if (toml::table* table = node.as_table()) resolve_table(*table);
    if (toml::array* array = node.as_array()) {
      for (size_t i = 0; i < array->size(); ++i) {
        if (is_keyframed((*array)[i])) {
          if (auto value = value_of(*(*array)[i].as_table())) {
            array->replace(array->cbegin() + std::ptrdiff_t(i), std::move(*value->get("v")));
          }
        } else {
          resolve((*array)[i]);
        }
      }
    }
  }

  std::vector<Diagnostic> take_problems() { return std::move(m_problems); }

 private:
  void resolve_table(toml::table& table) {
    std::vector<toml::key> keys;
    for (const auto& [key, child] : table) keys.push_back(key);
    for (const toml::key& key : keys) {
      toml::node& child = *table.get(key);
      if (!is_keyframed(child)) {
        resolve(child);
      } else if (auto value = value_of(*child.as_table())) {
        table.insert_or_assign(key, std::move(*value->get("v")));
      }
    }
  }

  void problem(const toml::node& node, std::string message) {
    const toml::source_region& at = node.source();
    const bool is_elsewhere = at.path && *at.path != m_file;  // an override
    m_problems.push_back(
        {is_elsewhere ? SourceLoc{*at.path} : SourceLoc{m_file, int(at.begin.line), int(at.begin.column)},
         std::move(message)});
  }

  /// True where times and values are as they should be; notes what is not.
  bool check(const toml::table& keyframes) {
    const toml::node &times_node = *keyframes.get("times"), &values_node = *keyframes.get("values");
    const toml::array *times = times_node.as_array(), *values = values_node.as_array();
    if (!times || times->empty()) {
      problem(times_node, fmt::format("keyframes: times = {}; expected a list of at least one frame",
                                      describe_node(times_node)));
      return false;
    }
    if (!values || values->size() != times->size()) {
      problem(values_node, fmt::format("keyframes: values = {}; expected an array of {}: one for each time",
                                       describe_node(values_node), times->size()));
      return false;
    }
    for (size_t i = 0; i < times->size(); ++i) {
      const std::optional<double> time = number_of((*times)[i]);
      const bool rises = time && std::isfinite(*time) && (i == 0 || *number_of((*times)[i - 1]) < *time);
      if (!rises) {
        problem((*times)[i], fmt::format("keyframes: {} among times; expected numbers that rise",
                                         describe_node((*times)[i])));
        return false;
      }
      if (!are_alike((*values)[0], (*values)[i])) {
        problem((*values)[i],
                fmt::format("keyframes: {} among values; expected numbers, or arrays of numbers of one shape",
                            describe_node((*values)[i])));
        return false;
      }
    }
    return check_interpolation(keyframes);
  }

  bool check_interpolation(const toml::table& keyframes) {
    const toml::node* node = keyframes.get("interpolation");
    if (!node) return true;
    const std::string found = node->value_or(std::string());
    if (found == "linear" || found == "smooth") return true;
    const std::string nearest = nearest_name(found, {"linear", "smooth"});
    problem(*node, fmt::format("keyframes: interpolation = {}; expected \"linear\" or \"smooth\"{}",
                               describe_node(*node), nearest.empty() ? "" : "; nearest: " + nearest));
    return false;
  }

  /// A table whose "v" is the value at the frame.
  std::optional<toml::table> value_of(toml::table& keyframes) {
    if (!check(keyframes)) return std::nullopt;
    toml::array &times = *keyframes.get("times")->as_array(), &values = *keyframes.get("values")->as_array();
    size_t after = 0;
    while (after < times.size() && *number_of(times[after]) <= m_frame) ++after;
    const size_t before = after == 0 ? 0 : after - 1;
    toml::table result;
    result.insert("v", std::move(values[before]));
    if (after > 0 && after < times.size() && *number_of(times[before]) < m_frame) {
      const bool is_smooth = keyframes["interpolation"].value_or(std::string()) == "smooth";
      std::array<double, 4> around{};
      NodesAround nodes{};
      for (size_t k = 0; k < around.size(); ++k) {
        const size_t index = before + k - 1;  // before = 0 wraps around to what no array holds
        if (index >= times.size()) continue;
        around[k] = *number_of(times[index]);
        nodes[k] = index == before ? result.get("v") : &values[index];
      }
      Interpolator(around, m_frame, is_smooth).blend(result, toml::key("v"), *result.get("v"), nodes);
    }
    return result;
  }

  double m_frame;
  const std::string& m_file;
  std::vector<Diagnostic> m_problems;
};

}  // namespace

std::vector<Diagnostic> resolve_keyframes(toml::table& root, double frame, const std::string& file) {
  KeyframeResolver resolver(frame, file);
  resolver.resolve(root);
  return resolver.take_problems();
}

}  // namespace pileus
