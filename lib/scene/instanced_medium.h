#pragma once

#include <memory>
#include <string>

#include "lib/scene/medium.h"

namespace pileus {

/// A volume that is another one in other places. The scene reader gives it the other's light.
struct InstancedMedium : Medium {
  /// The volume of which these are instances.
  virtual const std::string& original() const = 0;

  /// Its density in all places; throws Error.
  virtual std::shared_ptr<const DensityField> place(std::shared_ptr<const DensityField> original) const = 0;

  bool has_own_light() const final { return false; }

  /// Nothing stands anywhere before it is placed.
  std::shared_ptr<const DensityField> build(const FreeForms&) const final { return nullptr; }
};

}  // namespace pileus
