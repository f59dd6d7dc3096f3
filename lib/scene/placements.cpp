#include "lib/scene/placements.h"

#include <cmath>

#include "lib/core/error.h"
#include "lib/geom/placement_table.h"

namespace pileus {

void Placements::describe(ParamTable& params) {
  m_all.describe(params);
  params.group_list(
      "placements", [this](ParamTable& next) { m_each.emplace_back().describe(next); },
      "many places, each with scale, rotate_deg and translate");
  params.file("file", m_file, "very many places: .csv with lines x,y,z,scale,turn");
}

std::vector<Affine> Placements::placed_from_original() const {
  std::vector<Placement> each(m_each.begin(), m_each.end());
  if (!m_file.empty()) {
    for (const TablePlace& place : read_placement_table(m_file))
      each.push_back({Vec3d(place.scale), {0.0, place.turn_deg, 0.0}, place.position});
  }
  if (each.empty()) each.emplace_back();
  std::vector<Affine> maps;
  for (const Placement& placement : each) {
    maps.push_back(m_all.world_from_object() * placement.world_from_object());
    if (!(std::fabs(maps.back().determinant()) > 0.0)) {
      throw Error(ErrorKind::scene, SourceLoc{}, "a placement flattens the object; expected scales above 0");
    }
  }
  return maps;
}

}  // namespace pileus
