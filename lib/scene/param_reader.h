#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <toml++/toml.h>

#include "lib/core/error.h"
#include "lib/core/param_table.h"
#include "lib/core/registry.h"

namespace pileus {

/// A name that one object uses for another; checked when all objects are known.
struct PendingReference {
  SourceLoc loc;
  std::string owner;  ///< who refers, as messages name it: `volume "cumulus"`
  std::string section;
  std::string name;
};

/// Fills parameter tables from TOML and collects everything that is wrong, so that one run reports it all.
class ParamReader {
 public:
  /// `file` stands in messages; relative paths start at `folder`.
  ParamReader(std::string file, std::filesystem::path folder)
      : m_file(std::move(file)), m_folder(std::move(folder)) {}

  /// Sets the parameters that `table` names. Keys in `reserved` belong to the caller; others that the
  /// parameters do not know are problems. `owner` names the object in messages.
  void read(const toml::table& table, ParamTable& params, const std::string& owner,
            const std::vector<std::string>& reserved = {});

  /// Makes, fills and commits the plugin that a node asks for: a name ("hg") or a table with `type`. Returns
  /// null after a problem.
  std::shared_ptr<Plugin> make_plugin(const std::string& kind, const toml::node& node,
                                      const std::string& owner);

  /// The plugin `name` with all its defaults.
  std::shared_ptr<Plugin> make_default_plugin(const std::string& kind, const std::string& name);

  /// Makes an object known to parameters that name it.
  void add_object(const std::string& section, const std::string& name, std::shared_ptr<const Plugin> object) {
    m_objects[{section, name}] = std::move(object);
  }

  void problem(const SourceLoc& loc, std::string message) { m_problems.push_back({loc, std::move(message)}); }

  SourceLoc loc(const toml::source_region& source) const;
  SourceLoc loc(const toml::node& node) const { return loc(node.source()); }

  const std::vector<Diagnostic>& problems() const { return m_problems; }
  std::vector<Diagnostic> sorted_problems() const;  ///< in the order of the file
  const std::vector<PendingReference>& references() const { return m_references; }
  const std::vector<std::filesystem::path>& files() const { return m_files; }  ///< named by parameters

 private:
  void set(Param& param, const toml::node& node, const std::string& owner);
  /// Checks a number, or those in arrays up to the first that is wrong.
  bool check_numbers(const Param& param, const toml::node& node, const std::string& owner);

  std::string m_file;
  std::filesystem::path m_folder;
  std::vector<Diagnostic> m_problems;
  std::vector<PendingReference> m_references;
  std::map<std::pair<std::string, std::string>, std::shared_ptr<const Plugin>> m_objects;
  std::vector<std::filesystem::path> m_files;
};

/// "string", "number", …: what a node holds, for messages.
std::string describe_node(const toml::node& node);

}  // namespace pileus
