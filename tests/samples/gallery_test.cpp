// What the program can do is shown by some scene of the samples, and all of those are held against the
// reference: plugins, and the parameters that are more than a number.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <toml++/toml.h>

#include "lib/core/param_table.h"
#include "lib/core/registry.h"
#include "lib/scene/free_form_recipe.h"
#include "lib/scene/scene.h"

namespace pileus {
namespace {

namespace fs = std::filesystem;

/// Which scenes show a feature, by its name.
using Shown = std::map<std::string, std::set<std::string>>;

/// More than a value: something that the program has code of its own for.
bool is_feature(const Param& param) {
  return std::visit(
      []<class T>(const T&) {
        return std::is_same_v<T, GroupSlot> || std::is_same_v<T, GroupListSlot> ||
               std::is_same_v<T, ObjectSlot> || std::is_same_v<T, ReferenceListSlot>;
      },
      param.target);
}

/// Goes through what may be said, and where there is a table through what it says.
class Walk {
 public:
  Walk(Shown& features, std::string scene) : m_features(features), m_scene(std::move(scene)) {}

  void plugin(const std::string& kind, const toml::node* node, const std::string& default_name) {
    std::string name = default_name;
    const toml::table* table = node ? node->as_table() : nullptr;
    if (node && node->is_string()) name = node->as_string()->get();
    if (table) name = (*table)["type"].value_or(name);
    const PluginInfo* info = plugin_registry().find(kind, name);
    if (!info) return;
    note(kind + " " + name);
    const std::shared_ptr<Plugin> made = info->make();
    ParamTable params;
    made->describe(params);
    walk(kind, params, table);
  }

  ///   of: the kind of plugin; its parameters are features of the kind, in whichever plugin and however deep
  void walk(const std::string& of, ParamTable& params, const toml::table* table) {
    for (Param& param : params.params()) {
      const toml::node* node = table ? table->get(param.name) : nullptr;
      const std::string name = of + ": " + param.name;
      if (is_feature(param)) m_features[name];
      if (node && is_feature(param)) note(name);
      if (node) note("a parameter of type " + type_name(param));
      if (const auto* slot = std::get_if<PluginSlot>(&param.target); slot && table)
        plugin(slot->kind, node, slot->default_name);
      if (const auto* group = std::get_if<GroupSlot>(&param.target)) {
        ParamTable inner;
        group->describe(inner);
        walk(of, inner, node ? node->as_table() : nullptr);
      }
      if (const auto* list = std::get_if<GroupListSlot>(&param.target)) {
        const toml::array* array = node ? node->as_array() : nullptr;
        for (size_t i = 0; i < std::max<size_t>(array ? array->size() : 0, 1); ++i) {
          ParamTable inner;
          list->describe_next(inner);
          walk(of, inner, array ? (*array)[i].as_table() : nullptr);
        }
      }
    }
  }

 private:
  void note(const std::string& feature) {
    std::set<std::string>& scenes = m_features[feature];
    if (!m_scene.empty()) scenes.insert(m_scene);
  }

  Shown& m_features;
  std::string m_scene;  ///< "": what may be said
};

/// All there is to show: no scene shows it yet.
void add_all(Shown& features) {
  Walk walk(features, "");
  for (const PluginInfo& info : plugin_registry().all()) {
    if (info.origin == "built in") walk.plugin(info.kind, nullptr, info.name);
  }
  FreeFormRecipe recipe;
  ParamTable params;
  recipe.describe(params);
  walk.walk("freeform", params, nullptr);
}

void add_scene(const fs::path& file, Shown& features) {
  const toml::table root = toml::parse_file(file.string());
  Walk walk(features, file.stem().string());
  const toml::node* render = root.get("render");
  walk.plugin(Integrator::kKind, render ? render->as_table()->get("integrator") : nullptr, "march");
  walk.plugin(Camera::kKind, root.get("camera"), "");
  walk.plugin(Background::kKind, root.get("background"), "constant");
  for (const std::string kind :
       {Light::kKind, Medium::kKind, Shape::kKind, FogModel::kKind, Texture::kKind}) {
    const toml::node* section = root.get(kind);
    if (!section) continue;
    for (const auto& [name, object] : *section->as_table()) walk.plugin(kind, &object, "");
  }
  const toml::node* forms = root.get(FreeFormRecipe::kSection);
  if (!forms) return;
  for (const auto& [name, form] : *forms->as_table()) {
    FreeFormRecipe recipe;
    ParamTable params;
    recipe.describe(params);
    walk.walk("freeform", params, form.as_table());
  }
}

const Shown& shown() {
  static const Shown features = [] {
    Shown all;
    add_all(all);
    const fs::path folder = fs::path(PILEUS_SOURCE_DIR) / "samples/scenes";
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.path().extension() == ".toml") add_scene(entry.path(), all);
    }
    return all;
  }();
  return features;
}

TEST(Gallery, shows_every_plugin_and_every_group_of_parameters) {
  for (const auto& [feature, scenes] : shown())
    EXPECT_FALSE(scenes.empty()) << "no scene of samples/scenes shows " << feature;
}

TEST(Gallery, shows_every_type_of_parameter) {
  std::set<std::string> types;
  const auto add = [&](const auto& self, ParamTable& params) -> void {
    for (Param& param : params.params()) {
      types.insert("a parameter of type " + type_name(param));
      if (const auto* group = std::get_if<GroupSlot>(&param.target)) {
        ParamTable inner;
        group->describe(inner);
        self(self, inner);
      }
    }
  };
  for (const PluginInfo& info : plugin_registry().all()) {
    const std::shared_ptr<Plugin> made = info.make();
    ParamTable params;
    made->describe(params);
    add(add, params);
  }
  for (const std::string& type : types) EXPECT_TRUE(shown().contains(type)) << "no scene gives " << type;
}

/// The first few scenes.
std::string some_of(const std::set<std::string>& scenes) {
  constexpr size_t kMost = 4;
  std::vector<std::string> names(scenes.begin(), scenes.end());
  if (names.size() <= kMost) return fmt::format("{}", fmt::join(names, ", "));
  names.resize(kMost);
  return fmt::format("{} and more", fmt::join(names, ", "));
}

TEST(Gallery, tells_which_scene_shows_what) {
  std::string table;
  for (const auto& [feature, scenes] : shown()) {
    if (feature.find("parameter of type") == std::string::npos)
      table += fmt::format("| {} | {} |\n", feature, some_of(scenes));
  }
  std::ifstream file(std::string(PILEUS_SOURCE_DIR) + "/docs/gallery.md");
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  EXPECT_NE(page.find(table), std::string::npos) << "the table of docs/gallery.md should be\n" << table;
}

}  // namespace
}  // namespace pileus
