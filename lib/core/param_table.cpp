#include "lib/core/param_table.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "lib/core/error.h"
#include "lib/core/overload.h"

namespace pileus {

Param& ParamTable::add(std::string name, std::string unit, std::string help, ParamTarget target) {
  const bool taken =
      std::any_of(m_params.begin(), m_params.end(), [&](const Param& p) { return p.name == name; });
  PILEUS_CHECK(!taken);
  Param param;
  param.name = std::move(name);
  param.unit = std::move(unit);
  param.help = std::move(help);
  param.target = std::move(target);
  return m_params.emplace_back(std::move(param));
}

Param& ParamTable::boolean(std::string name, bool& target, std::string help) {
  return add(std::move(name), "", std::move(help), &target);
}
Param& ParamTable::integer(std::string name, int& target, std::string help) {
  return add(std::move(name), "", std::move(help), &target);
}
Param& ParamTable::number(std::string name, double& target, std::string unit, std::string help) {
  return add(std::move(name), std::move(unit), std::move(help), &target);
}
Param& ParamTable::text(std::string name, std::string& target, std::string help) {
  return add(std::move(name), "", std::move(help), &target);
}
Param& ParamTable::file(std::string name, std::filesystem::path& target, std::string help) {
  return add(std::move(name), "", std::move(help), &target);
}
Param& ParamTable::size(std::string name, Vec2i& target, std::string unit, std::string help) {
  return add(std::move(name), std::move(unit), std::move(help), &target);
}
Param& ParamTable::vector(std::string name, Vec3d& target, std::string unit, std::string help) {
  return add(std::move(name), std::move(unit), std::move(help), &target);
}
Param& ParamTable::rgb(std::string name, Rgb& target, std::string unit, std::string help) {
  return add(std::move(name), std::move(unit), std::move(help), &target);
}
Param& ParamTable::points(std::string name, std::vector<Vec2d>& target, std::string unit, std::string help) {
  return add(std::move(name), std::move(unit), std::move(help), &target);
}
Param& ParamTable::reference(std::string name, std::string& target, std::string section, std::string help) {
  return add(std::move(name), "", std::move(help), ReferenceSlot{std::move(section), &target});
}
Param& ParamTable::references(std::string name, std::vector<std::string>& targets, std::string section,
                              std::string help) {
  return add(std::move(name), "", std::move(help), ReferenceListSlot{std::move(section), &targets});
}
Param& ParamTable::group_list(std::string name, std::function<void(ParamTable&)> describe_next,
                              std::string help) {
  return add(std::move(name), "", std::move(help), GroupListSlot{std::move(describe_next)});
}
Param& ParamTable::group(std::string name, std::function<void(ParamTable&)> describe, std::string help) {
  return add(std::move(name), "", std::move(help), GroupSlot{std::move(describe)});
}

std::string type_name(const Param& param) {
  return std::visit(Overload{
                        [](bool*) -> std::string { return "boolean"; },
                        [](int*) -> std::string { return "integer"; },
                        [](double*) -> std::string { return "number"; },
                        [](std::string*) -> std::string { return "string"; },
                        [](std::filesystem::path*) -> std::string { return "file"; },
                        [](Vec2i*) -> std::string { return "[integer, integer]"; },
                        [](Vec3d*) -> std::string { return "[number, number, number]"; },
                        [](std::vector<Vec2d>*) -> std::string { return "[[number, number], ...]"; },
                        [](const ReferenceSlot& slot) { return "name of a " + slot.section; },
                        [](const ReferenceListSlot& slot) { return "list of names of a " + slot.section; },
                        [](const ObjectSlot& slot) { return "name of a " + slot.section; },
                        [](const PluginSlot& slot) { return slot.kind + " plugin"; },
                        [](const GroupSlot&) -> std::string { return "table"; },
                        [](const GroupListSlot&) -> std::string { return "list of tables"; },
                    },
                    param.target);
}

std::string value_text(const Param& param) {
  if (param.is_required) return "required";
  return std::visit(
      Overload{
          [](bool* value) { return fmt::format("{}", *value); },
          [](int* value) { return fmt::format("{}", *value); },
          [](double* value) { return fmt::format("{}", *value); },
          [](std::string* value) { return fmt::format("\"{}\"", *value); },
          [](std::filesystem::path* value) { return fmt::format("\"{}\"", value->string()); },
          [](Vec2i* value) { return fmt::format("[{}, {}]", value->x, value->y); },
          [](Vec3d* value) { return fmt::format("[{}, {}, {}]", value->x, value->y, value->z); },
          [](std::vector<Vec2d>* value) {
            std::vector<std::array<double, 2>> pairs;
            for (const Vec2d& point : *value) pairs.push_back({point.x, point.y});
            return fmt::format("{}", pairs);
          },
          [](const ReferenceSlot& slot) { return fmt::format("\"{}\"", *slot.target); },
          [](const ReferenceListSlot& slot) { return fmt::format("{}", *slot.targets); },
          [](const ObjectSlot&) { return std::string("\"\""); },
          [](const PluginSlot& slot) {
            return slot.default_name.empty() ? "" : fmt::format("{{ type = \"{}\" }}", slot.default_name);
          },
          [](const GroupSlot&) { return std::string(); },
          [](const GroupListSlot&) { return std::string("[]"); },
      },
      param.target);
}

std::string range_text(const Param& param) {
  if (!param.choices.empty()) return join_or(param.choices);
  const auto sign = [](const ParamLimit& limit) { return limit.inclusive ? "<=" : "<"; };
  if (param.lower && param.upper) {
    return fmt::format("{} {} {} {} {}", param.lower->value, sign(*param.lower), param.name,
                       sign(*param.upper), param.upper->value);
  }
  if (param.lower) return fmt::format("{} {}", param.lower->inclusive ? ">=" : ">", param.lower->value);
  if (param.upper) return fmt::format("{} {}", param.upper->inclusive ? "<=" : "<", param.upper->value);
  return "";
}

}  // namespace pileus
