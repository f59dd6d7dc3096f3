#include "integrators/exact_tracer.h"

#include <optional>
#include <utility>
#include <vector>

#include "lib/core/registry.h"

namespace pileus {
namespace {

/// Rays that the march cannot do.
class OtherTracer final : public Tracer {
 public:
  OtherTracer(std::unique_ptr<const Tracer> exact, const std::string& why, const EffectPlan& plan)
      : m_exact(std::move(exact)), m_choices{"rays go to \"exact\": " + why} {
    if (wants_bound(plan)) m_choices.push_back("error_bound: none, \"exact\" estimates its error");
  }

  size_t rays_per_call() const override { return m_exact->rays_per_call(); }
  std::vector<std::string> choices() const override { return m_choices; }
  std::optional<RayResult> seen_alike(const Beam& beam) const override { return m_exact->seen_alike(beam); }
  void trace(std::span<const Ray> rays, std::span<RayResult> results, Counters& counters) const override {
    m_exact->trace(rays, results, counters);
  }

 private:
  std::unique_ptr<const Tracer> m_exact;
  std::vector<std::string> m_choices;
};

}  // namespace

std::unique_ptr<const Tracer> prepare_exact(const World& world, const EffectPlan& plan,
                                            const Accuracy& accuracy) {
  const auto exact = plugin_registry().find(Integrator::kKind, "exact")->make();
  return std::dynamic_pointer_cast<Integrator>(exact)->prepare(world, plan, accuracy);
}

std::unique_ptr<const Tracer> hand_over_all(const World& world, const EffectPlan& plan,
                                            const Accuracy& accuracy, const std::string& why) {
  return std::make_unique<OtherTracer>(prepare_exact(world, plan, accuracy), why, plan);
}

bool wants_bound(const EffectPlan& plan) {
  return plan.aovs.count("error_bound") > 0;
}

}  // namespace pileus
