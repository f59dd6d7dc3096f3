#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "lib/core/param_table.h"
#include "lib/core/registry.h"
#include "lib/math/affine.h"
#include "lib/scene/phase_function.h"
#include "lib/scene/scattering.h"
#include "lib/volume/density_field.h"

namespace pileus {

class FreeForm;

/// The scene's `[freeform.NAME]` objects, which volumes refer to by name.
using FreeForms = std::map<std::string, FreeForm>;

/// What a volume has read from a file, ready to become a field.
class LoadedDensity {
 public:
  virtual ~LoadedDensity() = default;
  virtual std::shared_ptr<const DensityField> build() const = 0;
};

/// What light does in a volume. sigma_t(p) = extinction * rho(p): grey, so that alpha = 1 - transmittance is
/// one number per pixel.
struct MediumLight {
  double extinction = 1.0;      ///< sigma_t at rho = 1 [1/m]
  Rgb albedo{1.0, 1.0, 1.0};    ///< sigma_s / sigma_t, per channel
  Rgb emission{0.0, 0.0, 0.0};  ///< radiance emitted per metre at rho = 1 [W/(m3 sr)]
  std::shared_ptr<const PhaseFunction> phase;
  MultipleScattering multiple_scattering;
  Powder powder;
  SkyAround ambient;

  void describe_light(ParamTable& params);
};

/// A volume of the scene: where its density comes from (the plugin) and what light does in it (the common
/// part).
struct Medium : Plugin, MediumLight {
  static constexpr const char* kKind = "volume";

  bool hidden = false;  ///< not part of the world itself: instances are made of it

  void describe(ParamTable& params) final;

  /// The parameters of the density source.
  virtual void describe_density(ParamTable& params) = 0;

  /// False where light does what it does in another volume.
  virtual bool has_own_light() const { return true; }

  /// True where the density is a grid of voxels.
  virtual bool is_grid() const { return false; }

  /// Where the volume's own parameters put what it holds.
  virtual Affine world_from_object() const { return Affine(); }

  /// Reads the file behind the volume, where there is one. Throws Error.
  virtual std::unique_ptr<LoadedDensity> load() const { return nullptr; }

  /// Builds the density in world space, loading first what is needed. May take long; uses parallel_for.
  /// Throws Error.
  virtual std::shared_ptr<const DensityField> build(const FreeForms& freeforms) const = 0;
};

/// Placement parameters shared by volumes: scale, then rotate about x, y, z, then translate.
struct Placement {
  Vec3d scale{1.0, 1.0, 1.0};
  Vec3d rotate_deg{0.0, 0.0, 0.0};
  Vec3d translate{0.0, 0.0, 0.0};

  void describe(ParamTable& params);
  Affine world_from_object() const;
};

}  // namespace pileus
