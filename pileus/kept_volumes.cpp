#include "pileus/kept_volumes.h"

#include <algorithm>
#include <utility>

namespace pileus {
namespace {

class BuiltAlready final : public LoadedDensity {
 public:
  explicit BuiltAlready(std::shared_ptr<const DensityField> density) : m_density(std::move(density)) {}
  std::shared_ptr<const DensityField> build() const override { return m_density; }

 private:
  std::shared_ptr<const DensityField> m_density;
};

}  // namespace

LoadedVolumes KeptVolumes::load(const Scene& scene) const {
  const auto kept_of = [&](const std::string& name) {
    const auto key = keys.find(name);
    const auto kept = m_kept.find(name);
    const bool is_same = key != keys.end() && kept != m_kept.end() && key->second == kept->second.key;
    return is_same ? kept->second.density : nullptr;
  };
  Scene changed = scene;
  std::erase_if(changed.volumes, [&](const auto& volume) { return kept_of(volume.name) != nullptr; });
  LoadedVolumes read = load_volumes(changed), loaded;
  auto next = read.begin();
  for (const Named<Medium>& volume : scene.volumes) {
    const auto density = kept_of(volume.name);
    loaded.push_back(density ? std::make_unique<BuiltAlready>(density) : std::move(*next++));
  }
  return loaded;
}

void KeptVolumes::keep(const World& world) {
  m_kept.clear();
  for (const WorldMedium& medium : world.media) {
    const auto key = keys.find(medium.name);
    if (key != keys.end()) m_kept[medium.name] = {key->second, medium.density};
  }
}

}  // namespace pileus
