#include "lib/scene/param_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include <fmt/ranges.h>

#include "lib/core/overload.h"

namespace pileus {
namespace {

std::optional<double> as_number(const toml::node& node) {
  if (const auto* integer = node.as_integer()) return double(integer->get());
  if (const auto* real = node.as_floating_point()) return real->get();
  return std::nullopt;
}

std::optional<int> as_int(const toml::node& node) {
  const auto* integer = node.as_integer();
  if (!integer) return std::nullopt;
  const int64_t value = integer->get();
  if (value < std::numeric_limits<int>::min() || value > std::numeric_limits<int>::max()) return std::nullopt;
  return int(value);
}

/// The part of a node by which it is no array of `count` values that `is_value` accepts: an element where
/// only that is wrong, or the node itself; null where nothing is.
template <class IsValue>
const toml::node* misfit(const toml::node& node, size_t count, const IsValue& is_value) {
  const toml::array* array = node.as_array();
  if (!array || array->size() != count) return &node;
  for (const toml::node& element : *array) {
    if (!is_value(element)) return &element;
  }
  return nullptr;
}

/// The same for a list of pairs of numbers.
const toml::node* misfit_of_points(const toml::node& node) {
  const toml::array* array = node.as_array();
  if (!array) return &node;
  for (const toml::node& element : *array) {
    if (const toml::node* part = misfit(element, 2, as_number)) return part;
  }
  return nullptr;
}

Vec2d as_point(const toml::node& pair) {
  return {*as_number((*pair.as_array())[0]), *as_number((*pair.as_array())[1])};
}

bool within(const Param& param, double value) {
  if (param.lower && (param.lower->inclusive ? value < param.lower->value : value <= param.lower->value))
    return false;
  if (param.upper && (param.upper->inclusive ? value > param.upper->value : value >= param.upper->value))
    return false;
  return true;
}

std::string range_hint(const Param& param) {
  const std::string range = range_text(param);
  return range.empty() ? "" : fmt::format(" ({})", range);
}

/// "expected a, b or c; nearest: b"
std::string alternatives(std::string_view found, const std::vector<std::string>& names) {
  if (names.empty()) return "none is known";
  const std::string nearest = nearest_name(found, names);
  return fmt::format("expected {}{}", join_or(names), nearest.empty() ? "" : "; nearest: " + nearest);
}

/// The plugin's parameters. One that is called "preset" chooses the defaults of the others: where the scene
/// gives it, it is set first, and the plugin describes itself once more.
ParamTable described(Plugin& plugin, const toml::table& table) {
  ParamTable params;
  plugin.describe(params);
  const auto preset = std::find_if(params.params().begin(), params.params().end(),
                                   [](const Param& param) { return param.name == "preset"; });
  const auto name = table["preset"].value<std::string>();
  if (preset == params.params().end() || !name) return params;
  const auto& choices = preset->choices;
  if (std::find(choices.begin(), choices.end(), *name) == choices.end())
    return params;  // read() will complain
  *std::get<std::string*>(preset->target) = *name;
  ParamTable anew;
  plugin.describe(anew);
  return anew;
}

/// As TOML writes it: 1.0 is no integer.
std::string real_text(double value) {
  const std::string text = fmt::format("{}", value);
  return text.find_first_not_of("-0123456789") == std::string::npos ? text + ".0" : text;
}

}  // namespace

std::string describe_node(const toml::node& node) {
  if (const auto* text = node.as_string()) return fmt::format("\"{}\"", text->get());
  if (const auto* integer = node.as_integer()) return fmt::format("{}", integer->get());
  if (const auto* real = node.as_floating_point()) return real_text(real->get());
  if (const auto* truth = node.as_boolean()) return truth->get() ? "true" : "false";
  if (const auto* array = node.as_array()) return fmt::format("an array of {}", array->size());
  if (node.is_table()) return "a table";
  return "a date or time";
}

std::vector<Diagnostic> ParamReader::sorted_problems() const {
  std::vector<Diagnostic> sorted = m_problems;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return std::tie(a.loc.line, a.loc.column) < std::tie(b.loc.line, b.loc.column);
  });
  return sorted;
}

SourceLoc ParamReader::loc(const toml::source_region& source) const {
  if (source.path && *source.path != m_file) return {*source.path};  // an override, not a place in the file
  return {m_file, int(source.begin.line), int(source.begin.column)};
}

void ParamReader::read(const toml::table& table, ParamTable& params, const std::string& owner,
                       const std::vector<std::string>& reserved) {
  std::vector<std::string> known = reserved;
  for (const Param& param : params.params()) known.push_back(param.name);

  bool all_known = true;
  for (const auto& [key, node] : table) {
    const std::string_view name = key.str();
    if (std::find(reserved.begin(), reserved.end(), name) != reserved.end()) continue;
    const auto param = std::find_if(params.params().begin(), params.params().end(),
                                    [&](const Param& candidate) { return candidate.name == name; });
    if (param == params.params().end()) {
      problem(loc(key.source()),
              fmt::format("{}: unknown parameter \"{}\"; {}", owner, name, alternatives(name, known)));
      all_known = false;
    } else {
      set(*param, node, owner);
    }
  }
  for (const std::vector<std::string>& names : params.alternatives()) {
    std::vector<std::string> given;
    for (const std::string& name : names) {
      if (table.contains(name)) given.push_back(name);
    }
    if (given.size() == 1 || (given.empty() && !all_known)) continue;  // a misspelt name has been told
    problem(loc(table), fmt::format("{} has {}; expected exactly one of {}", owner,
                                    given.empty() ? "none" : fmt::format("{}", fmt::join(given, " and ")),
                                    join_or(names)));
  }
  for (Param& param : params.params()) {
    if (table.contains(param.name)) continue;
    if (param.is_required) {
      problem(loc(table), fmt::format("{}: parameter \"{}\" is missing: {}", owner, param.name, param.help));
    }
    const auto* slot = std::get_if<PluginSlot>(&param.target);
    if (slot && !slot->default_name.empty()) {
      slot->assign(make_default_plugin(slot->kind, slot->default_name));
    }
  }
}

void ParamReader::set(Param& param, const toml::node& node, const std::string& owner) {
  const SourceLoc at = loc(node);
  const auto expected_at = [&](const toml::node& part, std::string_view what) {
    problem(loc(part),
            fmt::format("{}: {} {} {}; expected {}{}", owner, param.name, &part == &node ? "=" : "holds",
                        describe_node(part), what, range_hint(param)));
  };
  const auto expected = [&](std::string_view what) { expected_at(node, what); };

  std::visit(
      Overload{
          [&](bool* target) {
            const auto* truth = node.as_boolean();
            if (!truth) return expected("true or false");
            *target = truth->get();
          },
          [&](int* target) {
            const std::optional<int> value = as_int(node);
            if (!value) return expected("an integer");
            check_numbers(param, node, owner);
            *target = *value;
          },
          [&](double* target) {
            const std::optional<double> value = as_number(node);
            if (!value) return expected("a number");
            check_numbers(param, node, owner);
            *target = *value;
          },
          [&](std::string* target) {
            const auto* text = node.as_string();
            if (!text) return expected("a string");
            const auto& choices = param.choices;
            if (!choices.empty() && std::find(choices.begin(), choices.end(), text->get()) == choices.end()) {
              return problem(at, fmt::format("{}: {} = \"{}\"; {}", owner, param.name, text->get(),
                                             alternatives(text->get(), choices)));
            }
            *target = text->get();
          },
          [&](std::filesystem::path* target) {
            const auto* text = node.as_string();
            if (!text || text->get().empty()) return expected("a file name");
            *target = m_folder / std::filesystem::path(text->get());
            m_files.push_back(*target);
          },
          [&](Vec2i* target) {
            if (const auto* part = misfit(node, 2, as_int)) return expected_at(*part, "[integer, integer]");
            check_numbers(param, node, owner);
            const toml::array& array = *node.as_array();
            *target = Vec2i(*as_int(array[0]), *as_int(array[1]));
          },
          [&](Vec3d* target) {
            if (const auto* part = misfit(node, 3, as_number))
              return expected_at(*part, "[number, number, number]");
            check_numbers(param, node, owner);
            const toml::array& array = *node.as_array();
            *target = Vec3d(*as_number(array[0]), *as_number(array[1]), *as_number(array[2]));
          },
          [&](std::vector<Vec2d>* target) {
            if (const auto* part = misfit_of_points(node))
              return expected_at(*part, "a list of pairs [[number, number], ...]");
            check_numbers(param, node, owner);
            target->clear();
            for (const toml::node& pair : *node.as_array()) target->push_back(as_point(pair));
          },
          [&](const ReferenceSlot& slot) {
            const auto* text = node.as_string();
            if (!text) return expected(fmt::format("the name of a {}", slot.section));
            *slot.target = text->get();
            m_references.push_back({at, owner, slot.section, text->get()});
          },
          [&](const ReferenceListSlot& slot) {
            const toml::array* array = node.as_array();
            if (!array) return expected(fmt::format("a list of names [\"{}\", ...]", slot.section));
            slot.targets->clear();
            for (const toml::node& element : *array) {
              const auto* text = element.as_string();
              if (!text) {
                return problem(loc(element), fmt::format("{}: {} holds {}; expected the name of a {}", owner,
                                                         param.name, describe_node(element), slot.section));
              }
              slot.targets->push_back(text->get());
              m_references.push_back({loc(element), owner, slot.section, text->get()});
            }
          },
          [&](const ObjectSlot& slot) {
            const auto* text = node.as_string();
            if (!text) return expected(fmt::format("the name of a {}", slot.section));
            m_references.push_back({at, owner, slot.section, text->get()});
            const auto object = m_objects.find({slot.section, text->get()});
            if (object != m_objects.end()) slot.assign(object->second);
          },
          [&](const PluginSlot& slot) { slot.assign(make_plugin(slot.kind, node, owner)); },
          [&](const GroupSlot& slot) {
            const toml::table* table = node.as_table();
            if (!table) return expected("a table { ... }");
            ParamTable group;
            slot.describe(group);
            read(*table, group, fmt::format("{}: {}", owner, param.name));
          },
          [&](const GroupListSlot& slot) {
            const toml::array* array = node.as_array();
            if (!array) return expected("a list of tables [{ ... }, ...]");
            for (size_t i = 0; i < array->size(); ++i) {
              const toml::node& element = (*array)[i];
              const std::string self = fmt::format("{}: {} {}", owner, param.name, i + 1);
              const toml::table* table = element.as_table();
              if (!table) {
                problem(loc(element),
                        fmt::format("{} is {}; expected a table {{ ... }}", self, describe_node(element)));
                continue;
              }
              ParamTable group;
              slot.describe_next(group);
              read(*table, group, self);
            }
          },
      },
      param.target);
}

bool ParamReader::check_numbers(const Param& param, const toml::node& node, const std::string& owner) {
  if (const toml::array* array = node.as_array()) {
    return std::all_of(array->begin(), array->end(),
                       [&](const toml::node& element) { return check_numbers(param, element, owner); });
  }
  const double value = as_number(node).value();
  const bool is_finite = std::isfinite(value);
  if (is_finite && within(param, value)) return true;
  problem(loc(node), is_finite ? fmt::format("{}: {} = {} is out of range; expected {}", owner, param.name,
                                             value, range_text(param))
                               : fmt::format("{}: {} = {} is not a finite number", owner, param.name, value));
  return false;
}

std::shared_ptr<Plugin> ParamReader::make_plugin(const std::string& kind, const toml::node& node,
                                                 const std::string& owner) {
  const toml::table* table = node.as_table();
  const toml::node* type = table ? table->get("type") : &node;
  const auto* name = type ? type->as_string() : nullptr;
  const std::vector<std::string> names = plugin_registry().names(kind);
  if (!name) {
    problem(
        type ? loc(*type) : loc(node),
        type ? fmt::format("{}: {} type = {}; expected {}", owner, kind, describe_node(*type), join_or(names))
             : fmt::format("{}: {} has no type; expected type = {}", owner, kind, join_or(names)));
    return nullptr;
  }
  const PluginInfo* info = plugin_registry().find(kind, name->get());
  if (!info) {
    problem(loc(*type), fmt::format("{}: unknown {} type \"{}\"; {}", owner, kind, name->get(),
                                    alternatives(name->get(), names)));
    return nullptr;
  }
  std::shared_ptr<Plugin> plugin = info->make();
  const std::string self =
      node.is_table() && owner.find(kind) == 0 ? owner : fmt::format("{}: {}", owner, kind);
  static const toml::table no_parameters;
  const size_t problems_before = m_problems.size();
  ParamTable params = described(*plugin, table ? *table : no_parameters);
  read(table ? *table : no_parameters, params, self, {"type"});
  if (m_problems.size() != problems_before) return nullptr;  // commit() may rely on valid values
  std::vector<std::string> complaints;
  plugin->commit(complaints);
  for (const std::string& complaint : complaints) problem(loc(node), fmt::format("{}: {}", self, complaint));
  return complaints.empty() ? plugin : nullptr;
}

std::shared_ptr<Plugin> ParamReader::make_default_plugin(const std::string& kind, const std::string& name) {
  const toml::value<std::string> node(name);
  return make_plugin(kind, node, "default");
}

}  // namespace pileus
