#pragma once

#include <memory>
#include <string>

#include "lib/scene/effect_plan.h"
#include "lib/scene/integrator.h"
#include "lib/scene/world.h"

namespace pileus {

// `exact` for whom some rays or scenes are too hard.

std::unique_ptr<const Tracer> prepare_exact(const World& world, const EffectPlan& plan,
                                            const Accuracy& accuracy);

/// Hands all rays to `exact`, and says why.
std::unique_ptr<const Tracer> hand_over_all(const World& world, const EffectPlan& plan,
                                            const Accuracy& accuracy, const std::string& why);

/// Whether a proven bound of each ray's error is asked for.
bool wants_bound(const EffectPlan& plan);

}  // namespace pileus
