#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "lib/scene/world.h"

namespace pileus {

/// Densities that one render of a sequence built, for the next: a volume whose key is the same is neither
/// read nor built again.
struct KeptVolumes {
  std::map<std::string, uint64_t> keys;  ///< by name: what each volume's density is made of, in the scene
                                         ///< that is rendered next (volume_keys)

  /// load_volumes, without reading what is kept.
  LoadedVolumes load(const Scene& scene) const;

  /// Keeps what a scene was built to, and nothing else.
  void keep(const World& world);

 private:
  struct Kept {
    uint64_t key;
    std::shared_ptr<const DensityField> density;
  };
  std::map<std::string, Kept> m_kept;
};

}  // namespace pileus
