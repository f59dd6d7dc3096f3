#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "lib/math/vec.h"

namespace pileus {

class ParamTable;
struct Plugin;

/// A parameter that is itself a plugin: `phase = { type = "hg", g = 0.6 }`.
struct PluginSlot {
  std::string kind;          ///< registry kind, such as "phase"
  std::string default_name;  ///< plugin used where the scene says nothing; "": none
  std::function<void(std::shared_ptr<Plugin>)> assign;
};

/// A parameter that is a table of further parameters: `noise = { octaves = 6 }`.
struct GroupSlot {
  std::function<void(ParamTable&)> describe;
};

/// A parameter that is a list of such tables: `perturb = [ { factor = 0.8 }, { factor = -1 } ]`.
struct GroupListSlot {
  std::function<void(ParamTable&)> describe_next;  ///< appends an element and describes it
};

/// A parameter that names another object of the scene: `bounds = "blob"` refers to `[freeform.blob]`.
struct ReferenceSlot {
  std::string section;  ///< the scene section that holds the objects, such as "freeform"
  std::string* target;
};

/// A parameter that names several: `union = ["head", "body"]`.
struct ReferenceListSlot {
  std::string section;
  std::vector<std::string>* targets;
};

/// A parameter that is another object of the scene: `texture = "bricks"` is `[texture.bricks]`. Objects that
/// others use are made first.
struct ObjectSlot {
  std::string section;
  std::function<void(std::shared_ptr<const Plugin>)> assign;
};

/// Where a parameter's value goes. A path is made relative to the scene file that names it.
using ParamTarget = std::variant<bool*, int*, double*, std::string*, std::filesystem::path*, Vec2i*, Vec3d*,
                                 std::vector<Vec2d>*, ReferenceSlot, ReferenceListSlot, ObjectSlot,
                                 PluginSlot, GroupSlot, GroupListSlot>;

/// One end of a parameter's range.
struct ParamLimit {
  double value = 0.0;
  bool inclusive = true;
};

/// The one declaration of a parameter: the scene reader, `pileus plugins`, the manual and hints all read
/// this.
struct Param {
  std::string name;
  std::string unit;  ///< "m", "1/m", "deg", …; "" where the value has none
  std::string help;
  ParamTarget target;
  std::optional<ParamLimit> lower, upper;  ///< hold for every component of a vector
  std::vector<std::string> choices;        ///< allowed strings; empty: any
  bool is_required = false;

  Param& above(double value) { return lower = ParamLimit{value, false}, *this; }
  Param& at_least(double value) { return lower = ParamLimit{value, true}, *this; }
  Param& below(double value) { return upper = ParamLimit{value, false}, *this; }
  Param& at_most(double value) { return upper = ParamLimit{value, true}, *this; }
  Param& one_of(std::vector<std::string> names) { return choices = std::move(names), *this; }
  Param& required() { return is_required = true, *this; }
};

/// Collects the parameters of one object. An object's describe() binds each name to a member; the member's
/// value at that moment is the default. The table must not outlive the object.
class ParamTable {
 public:
  Param& boolean(std::string name, bool& target, std::string help);
  Param& integer(std::string name, int& target, std::string help);
  Param& number(std::string name, double& target, std::string unit, std::string help);
  Param& text(std::string name, std::string& target, std::string help);
  Param& file(std::string name, std::filesystem::path& target, std::string help);
  Param& size(std::string name, Vec2i& target, std::string unit, std::string help);
  Param& vector(std::string name, Vec3d& target, std::string unit, std::string help);
  Param& rgb(std::string name, Rgb& target, std::string unit, std::string help);
  /// A list of pairs, such as a profile [[x, y], …].
  Param& points(std::string name, std::vector<Vec2d>& target, std::string unit, std::string help);
  Param& reference(std::string name, std::string& target, std::string section, std::string help);
  Param& references(std::string name, std::vector<std::string>& targets, std::string section,
                    std::string help);
  Param& group(std::string name, std::function<void(ParamTable&)> describe, std::string help);
  Param& group_list(std::string name, std::function<void(ParamTable&)> describe_next, std::string help);

  /// Of these parameters a scene gives one and no more.
  void exactly_one_of(std::vector<std::string> names) { m_alternatives.push_back(std::move(names)); }
  const std::vector<std::vector<std::string>>& alternatives() const { return m_alternatives; }

  /// A parameter that is a plugin of Kind; `target` (to Kind or const Kind) receives a fresh one, configured
  /// from the scene.
  template <class Kind, class Target>
  Param& plugin(std::string name, std::shared_ptr<Target>& target, std::string default_name,
                std::string help) {
    auto assign = [&target](std::shared_ptr<Plugin> made) {
      target = std::dynamic_pointer_cast<Target>(std::move(made));
    };
    return add(std::move(name), "", std::move(help),
               PluginSlot{Kind::kKind, std::move(default_name), std::move(assign)});
  }

  /// A parameter that names an object of Kind; `target` receives it, or keeps what it is where the scene says
  /// nothing.
  template <class Kind>
  Param& object(std::string name, std::shared_ptr<const Kind>& target, std::string help) {
    auto assign = [&target](std::shared_ptr<const Plugin> made) {
      target = std::dynamic_pointer_cast<const Kind>(std::move(made));
    };
    return add(std::move(name), "", std::move(help), ObjectSlot{Kind::kKind, std::move(assign)});
  }

  std::vector<Param>& params() { return m_params; }
  const std::vector<Param>& params() const { return m_params; }

 private:
  Param& add(std::string name, std::string unit, std::string help, ParamTarget target);

  std::vector<Param> m_params;
  std::vector<std::vector<std::string>> m_alternatives;
};

/// "number", "rgb", … as listings name a parameter's type.
std::string type_name(const Param& param);

/// The present value as a scene file would spell it: the default, when asked right after describe().
std::string value_text(const Param& param);

/// "-1 < g < 1", ">= 0", "a, b or c"; "" where anything goes.
std::string range_text(const Param& param);

}  // namespace pileus
