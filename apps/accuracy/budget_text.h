#pragma once

#include <string>

#include "apps/scene_options.h"
#include "pileus/accuracy/budget.h"

namespace pileus {

/// The command line that renders with a setting, quoted for a shell. `size` is as --size takes it, "" for the
/// scene's own.
std::string render_command(const SceneOptions& scene, const std::string& size, int threads,
                           const AccuracySetting& setting);

/// The answer for people: what to expect, and how to get it.
std::string to_text(const BudgetAnswer& answer, double budget, const std::string& command);

/// The answer as JSON.
std::string to_json(const BudgetAnswer& answer, double budget, const std::string& command);

}  // namespace pileus
