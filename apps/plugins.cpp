#include <memory>
#include <variant>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands.h"
#include "lib/core/error.h"
#include "lib/core/param_table.h"
#include "lib/core/registry.h"

namespace pileus {
namespace {

using Json = nlohmann::ordered_json;

void print_list(const std::vector<const PluginInfo*>& plugins) {
  std::string kind;
  for (const PluginInfo* info : plugins) {
    if (info->kind != kind) fmt::print("{}{}\n", kind.empty() ? "" : "\n", info->kind);
    kind = info->kind;
    const std::string origin = info->origin == "built in" ? "" : fmt::format("  ({})", info->origin);
    fmt::print("  {:<14} {}{}\n", info->name, info->summary, origin);
  }
}

void print_params(const ParamTable& params, const std::string& indent) {
  for (const Param& param : params.params()) {
    const std::string unit = param.unit.empty() ? "" : fmt::format(" [{}]", param.unit);
    const std::string range = range_text(param), value = value_text(param);
    fmt::print("{}{:<16} {}{}{}{}\n", indent, param.name, type_name(param), unit,
               value.empty()       ? ""
               : param.is_required ? ", required"
                                   : ", default " + value,
               range.empty() ? "" : ", " + range);
    fmt::print("{}{:<16} {}\n", indent, "", param.help);
    if (const auto* group = std::get_if<GroupSlot>(&param.target)) {
      ParamTable inner;
      group->describe(inner);
      print_params(inner, indent + "  ");
    }
  }
}

void print_plugin(const PluginInfo& info) {
  const std::shared_ptr<Plugin> plugin = info.make();
  ParamTable params;
  plugin->describe(params);
  fmt::print("{} \"{}\": {}\n", info.kind, info.name, info.summary);
  if (params.params().empty()) fmt::print("  no parameters\n");
  print_params(params, "  ");
}

Json params_to_json(const ParamTable& params) {
  Json list = Json::array();
  for (const Param& param : params.params()) {
    Json entry = {{"name", param.name},         {"type", type_name(param)}, {"unit", param.unit},
                  {"range", range_text(param)}, {"help", param.help},       {"required", param.is_required}};
    if (!param.is_required) entry["default"] = value_text(param);
    if (const auto* group = std::get_if<GroupSlot>(&param.target)) {
      ParamTable inner;
      group->describe(inner);
      entry["params"] = params_to_json(inner);
    }
    list.push_back(std::move(entry));
  }
  return list;
}

void print_json(const std::vector<const PluginInfo*>& plugins) {
  Json list = Json::array();
  for (const PluginInfo* info : plugins) {
    const std::shared_ptr<Plugin> plugin = info->make();
    ParamTable params;
    plugin->describe(params);
    list.push_back({{"kind", info->kind},
                    {"name", info->name},
                    {"summary", info->summary},
                    {"origin", info->origin},
                    {"params", params_to_json(params)}});
  }
  fmt::print("{}\n", list.dump(2, ' ', false, Json::error_handler_t::replace));
}

/// The plugins of a name or a kind; all where `wanted` is empty.
std::vector<const PluginInfo*> select(const std::string& wanted) {
  std::vector<const PluginInfo*> selected;
  std::vector<std::string> names;
  for (const PluginInfo& info : plugin_registry().all()) {
    names.push_back(info.name);
    names.push_back(info.kind);
    if (wanted.empty() || info.name == wanted || info.kind == wanted) selected.push_back(&info);
  }
  if (selected.empty()) {
    const std::string nearest = nearest_name(wanted, names);
    throw Error(ErrorKind::usage, SourceLoc{},
                fmt::format("no plugin or kind \"{}\"; `pileus plugins` lists them{}", wanted,
                            nearest.empty() ? "" : "; nearest: " + nearest));
  }
  return selected;
}

}  // namespace

void add_plugins_command(CLI::App& app, int&) {
  struct Options {
    std::string name;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  CLI::App* sub = app.add_subcommand("plugins", "what is installed; one plugin's parameters");
  sub->add_option("NAME", options->name,
                  "a plugin or a kind: shows parameters with units, ranges and defaults");
  sub->add_flag("--json", options->json, "print JSON");
  sub->footer(
      "Examples:\n"
      "  pileus plugins\n"
      "  pileus plugins hg\n"
      "  pileus plugins volume\n"
      "  pileus plugins --plugin ./cornette_shanks.so cornette_shanks");
  sub->callback([options] {
    const std::vector<const PluginInfo*> plugins = select(options->name);
    if (options->json) return print_json(plugins);
    if (options->name.empty()) return print_list(plugins);
    for (const PluginInfo* info : plugins) print_plugin(*info);
  });
}

}  // namespace pileus
