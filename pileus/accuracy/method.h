#pragma once

#include <string>
#include <vector>

#include "lib/core/registry.h"
#include "lib/scene/scene.h"

namespace pileus {

/// A way to render: an integrator as it comes, or with one parameter off its default.
struct AccuracyMethod {
  std::string name;              ///< "march", or "march:leaping=false"
  std::string integrator;        ///< the plugin's name
  std::string parameter, value;  ///< what is off its default, as a scene spells it; "" for nothing
  bool is_set_by_step = false;  ///< its accuracy is set by its parameter "step" [m]; else by render.tolerance
};

/// Every integrator of the registry, each followed by one method per switch: booleans turned, and the other
/// choices of texts that have choices. The plugins' own parameter tables say which there are.
std::vector<AccuracyMethod> accuracy_methods(const Registry& registry);

/// Those of `all` that are named, in the order of `all`; no names mean all. Throws Error(usage) for unknown
/// ones.
std::vector<AccuracyMethod> chosen_methods(const std::vector<AccuracyMethod>& all,
                                           const std::vector<std::string>& names);

/// A method at one accuracy.
struct AccuracySetting {
  AccuracyMethod method;
  double step = 0.0;       ///< [m], where the method has one
  double tolerance = 0.0;  ///< render.tolerance

  /// What a ladder of settings varies.
  double value() const { return method.is_set_by_step ? step : tolerance; }
  double& value() { return method.is_set_by_step ? step : tolerance; }
};

/// The integrator as a scene writes it: `{ type = "march", leaping = false }`.
std::string integrator_text(const AccuracySetting& setting);

/// The scene rendered with this setting, its picture with these planes.
Scene with_setting(Scene scene, const AccuracySetting& setting, std::string aovs);

/// "march:leaping=false, tolerance 0.003".
std::string to_string(const AccuracySetting& setting);

}  // namespace pileus
