#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "lib/core/plugin_abi.h"

namespace pileus {

class ParamTable;

/// Base of everything a scene can name by `type = "…"`. A plugin is made, described, filled from the scene,
/// then committed once; after that it is const and safe to use from many threads.
struct Plugin {
  std::string plugin_name;  ///< the name under which the registry made it

  virtual ~Plugin() = default;

  /// Declares the parameters: the only place where their names appear.
  virtual void describe(ParamTable& params) = 0;

  /// Called once after all parameters are set: precompute here, and append a sentence for every combination
  /// of values that cannot work ("up is parallel to the view direction").
  virtual void commit(std::vector<std::string>& problems) { (void)problems; }
};

struct PluginInfo {
  std::string kind;     ///< "phase", "light", …: the interface's kKind
  std::string name;     ///< what a scene writes after `type =`
  std::string summary;  ///< one line for listings
  std::string origin;   ///< "built in", or the library it came from
  std::function<std::shared_ptr<Plugin>()> make;
};

/// Every plugin the program knows, in a fixed order.
class Registry {
 public:
  /// Throws Error(usage) where the kind already has a plugin of that name.
  void add(PluginInfo info);

  template <class Kind, class Type>
  void add(const std::string& name, std::string summary) {
    const auto make = [name] {
      auto plugin = std::make_shared<Type>();
      plugin->plugin_name = name;
      return plugin;
    };
    add({Kind::kKind, name, std::move(summary), m_origin, make});
  }

  const std::vector<PluginInfo>& all() const { return m_plugins; }
  std::vector<std::string> names(std::string_view kind) const;
  const PluginInfo* find(std::string_view kind, std::string_view name) const;

  /// Loads a plugin library (`.so`) and registers what it holds. Throws Error(usage) where the file is
  /// missing, is no pileus plugin, or was built for another plugin interface.
  void load_library(const std::filesystem::path& file);

 private:
  std::vector<PluginInfo> m_plugins;
  std::string m_origin = "built in";
};

/// The registry of this process: the built-in plugins, then those of PILEUS_PLUGIN_PATH (a colon-separated
/// list of libraries and of folders with libraries), then what load_library adds. Not safe to change while a
/// render runs.
Registry& plugin_registry();

/// Defines the function that the generated plugin table (or, in a plugin library, the loader) calls.
/// Use inside namespace pileus, once per file, with the file's stem as the name.
#define PILEUS_PLUGIN(Kind, name, Type, summary)      \
  void register_##Kind##_##name(Registry& registry);  \
  void register_##Kind##_##name(Registry& registry) { \
    registry.add<Kind, Type>(#name, summary);         \
  }                                                   \
  PILEUS_PLUGIN_ENTRY_POINTS(register_##Kind##_##name)

#ifdef PILEUS_BUILDING_PLUGIN_LIBRARY
#define PILEUS_PLUGIN_ENTRY_POINTS(register_function)      \
  extern "C" const char* pileus_plugin_abi() {             \
    return PILEUS_PLUGIN_ABI;                              \
  }                                                        \
  extern "C" void pileus_plugin_register(void* registry) { \
    register_function(*static_cast<Registry*>(registry));  \
  }
#else
#define PILEUS_PLUGIN_ENTRY_POINTS(register_function)
#endif

}  // namespace pileus
