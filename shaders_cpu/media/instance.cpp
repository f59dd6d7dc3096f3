/// Another volume once more, or many times, in other places: for the memory of one. Light does in all of them
/// what it does in that volume.
///
///   of           name of the volume: a grid (cloud, vdb), or instances of one
///   scale, rotate_deg, translate   where it is put, beyond where the volume stands itself
///   placements   a list of these, for many
///   file         .csv with lines x,y,z,scale,turn: [m], a factor, [deg] about the y axis; for very many
///
///   [volume.puff]
///   type = "cloud"
///   preset = "cumulus"
///   size = [5.6, 3.2, 4]
///   max_voxels = 2000000
///   extinction = 24
///   hidden = true        # only its instances are seen
///
///   [volume.sky]
///   type = "instance"
///   of = "puff"
///   file = "sky.csv"
///
/// An instance may be of instances. scale, rotate_deg and translate move all placements together. Where
/// places overlap, their densities add up. A volume that grows grows in thickness, too: scale changes
/// lengths, not the extinction.
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/param_table.h"
#include "lib/scene/instanced_medium.h"
#include "lib/scene/placements.h"
#include "lib/volume/instanced_field.h"

namespace pileus {
namespace {

struct InstanceOfVolume final : InstancedMedium {
  std::string m_of;
  Placements m_places;

  void describe_density(ParamTable& params) override {
    params.reference("of", m_of, kKind, "the volume that stands here, too").required();
    m_places.describe(params);
  }
  const std::string& original() const override { return m_of; }

  std::shared_ptr<const DensityField> place(std::shared_ptr<const DensityField> original) const override {
    if (!original->has_bricks()) {
      throw Error(
          ErrorKind::scene, SourceLoc{},
          fmt::format("volume \"{}\" is no grid of voxels; expected a cloud, a volume file or instances "
                      "of one",
                      m_of));
    }
    return make_instanced_field(std::move(original), m_places.placed_from_original());
  }
};

}  // namespace

PILEUS_PLUGIN(Medium, instance, InstanceOfVolume, "another volume in other places")

}  // namespace pileus
