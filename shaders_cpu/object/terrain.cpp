/// A terrain: a file of heights, and the surface between them.
///
///   file         .tif (GeoTIFF), .hgt, .asc, .npy, .exr or .png; see docs/terrain.md
///   cell_size    [m]   distance of heights, where the file's own is not to be taken; 0: the file's
///   threshold    [m]   lower parts of the file are left out, before scaling; default none are
///   interpolation   "bilinear" patches, or "bicubic": smooth, through the same heights
///   level_of_detail   [pixel]   by how much heights may be off where many of them fall on a pixel; 0: not at
///                all
///   scale, rotate_deg, translate   where it is put
///   shader       what light does on the surface; default phong
///
///   [object.valley]
///   type = "terrain"
///   file = "valley.tif"
///   translate = [0, -400, 0]
///
/// Before it is placed, the middle of the map lies at x = z = 0; x goes east (columns), z south (rows) and y
/// is the height. The surface is a sheet without thickness, seen from both sides; where a height is missing,
/// it has a hole. ref: METHODS 6
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "lib/core/param_table.h"
#include "lib/math/affine.h"
#include "lib/math/offset_point.h"
#include "lib/scene/medium.h"
#include "lib/scene/shape.h"
#include "lib/terrain/elevation_file.h"
#include "lib/terrain/height_field.h"

namespace pileus {
namespace {

struct Terrain final : Shape {
  std::filesystem::path m_file;
  double m_cell_size = 0.0;
  double m_threshold = -std::numeric_limits<double>::max();
  std::string m_interpolation = "bilinear";
  double m_level_of_detail = 0.0;  ///< [pixel]
  Placement m_placement;

  HeightField m_field;
  Affine m_grid_from_world;
  double m_metres_per_height = 1.0, m_cells_per_metre = 1.0;
  Box3d m_bounds;
  double m_reach = 0.0;  ///< [m] from the world's origin to the farthest corner

  void describe_form(ParamTable& params) override {
    params.file("file", m_file, "heights: .tif, .hgt, .asc, .npy, .exr or .png").required();
    params.number("cell_size", m_cell_size, "m", "distance of heights; 0: as the file says").at_least(0);
    params.number("threshold", m_threshold, "m", "what is lower in the file is left out");
    params.text("interpolation", m_interpolation, "how the surface goes between heights")
        .one_of({"bilinear", "bicubic"});
    params
        .number("level_of_detail", m_level_of_detail, "pixel",
                "by how much heights may be off where many fall on a pixel; 0: not at all")
        .at_least(0)
        .at_most(4);
    m_placement.describe(params);
  }

  void commit(std::vector<std::string>& problems) override {
    if (m_file.empty()) return;  // the reader has complained
    HeightTable table = read_elevation(m_file);
    if (m_cell_size > 0.0) table.cell_x = table.cell_y = m_cell_size;
    const Affine world_from_grid = m_placement.world_from_object() * object_from_grid(table);
    if (!(std::abs(world_from_grid.determinant()) > 0.0)) {
      problems.push_back("the placement flattens the terrain; expected scales that are not 0");
      return;
    }
    m_grid_from_world = world_from_grid.inverse();
    m_metres_per_height = length(world_from_grid.direction({0.0, 0.0, 1.0}));
    m_cells_per_metre = 1.0 / length(world_from_grid.direction({1.0, 0.0, 0.0}));
    const auto interpolation =
        m_interpolation == "bicubic" ? HeightInterpolation::bicubic : HeightInterpolation::bilinear;
    m_field = HeightField(std::move(table), interpolation, m_level_of_detail > 0.0);
    measure(world_from_grid);
  }

  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const override {
    return intersect_seen(ray, segment, {});
  }

  bool knows_clear_distance() const override { return true; }
  double clear_distance(std::span<const Ray> rays, const RaySight& seen) const override {
    Beam beam;
    for (const Ray& ray : rays) {
      const Ray in_grid = grid_ray(ray);
      beam.o.extendBy(in_grid.o);
      beam.d.extendBy(in_grid.d);
    }
    return m_field.clear_distance(beam, height_sight(seen));
  }

  std::optional<SurfaceHit> intersect_seen(const Ray& ray, Segment segment,
                                           const RaySight& seen) const override {
    const auto hit = m_field.intersect(grid_ray(ray), segment, m_threshold, height_sight(seen));
    if (!hit) return std::nullopt;
    const Vec3d up = normalize(world_normal({-hit->du, -hit->dv, 1.0}));
    const double error =
        4.0 * surface_error(length(ray.o) + hit->t + m_reach) + hit->deviation * m_metres_per_height;
    const bool is_inside = dot(up, ray.d) > 0.0;
    return SurfaceHit{hit->t, is_inside ? -up : up, error, is_inside};
  }

  Box3d bounds() const override { return m_bounds; }

 private:
  Ray grid_ray(const Ray& ray) const {
    return {m_grid_from_world.point(ray.o), m_grid_from_world.direction(ray.d)};
  }

  HeightSight height_sight(const RaySight& seen) const {
    const double heights_per_pixel = m_level_of_detail / m_metres_per_height;
    return {seen.clear, heights_per_pixel * seen.width, heights_per_pixel * seen.widening,
            m_cells_per_metre * seen.width, m_cells_per_metre * seen.widening};
  }

  /// (column, row, height) to (east, height, south), the middle of the map at the origin.
  static Affine object_from_grid(const HeightTable& table) {
    Imath::M44d rows(table.cell_x, 0, 0, 0,  //
                     0, 0, table.cell_y, 0,  //
                     0, 1, 0, 0,             //
                     -0.5 * table.cells_x() * table.cell_x, 0, -0.5 * table.cells_y() * table.cell_y, 1);
    return Affine(rows);
  }

  void measure(const Affine& world_from_grid) {
    const HeightTable& table = m_field.table();
    const HeightRange range = m_field.range();
    if (range.empty()) return;
    const double least = std::max(double(range.least), m_threshold);
    for (int k = 0; k < 8; ++k) {
      const Vec3d corner(k & 1 ? table.cells_x() : 0, k & 2 ? table.cells_y() : 0,
                         k & 4 ? double(range.greatest) : std::min(least, double(range.greatest)));
      const Vec3d p = world_from_grid.point(corner);
      m_bounds.extendBy(p);
      m_reach = std::max(m_reach, length(p));
    }
    m_reach += length(m_placement.translate);
    // Rounding of the corners.
    const double margin = surface_error(m_reach);
    m_bounds.min -= Vec3d(margin), m_bounds.max += Vec3d(margin);
  }

  /// A normal is a gradient: it goes with the transpose of the map back.
  Vec3d world_normal(const Vec3d& n) const {
    const Imath::M44d& m = m_grid_from_world.matrix();
    return {m[0][0] * n.x + m[0][1] * n.y + m[0][2] * n.z, m[1][0] * n.x + m[1][1] * n.y + m[1][2] * n.z,
            m[2][0] * n.x + m[2][1] * n.y + m[2][2] * n.z};
  }
};

}  // namespace

PILEUS_PLUGIN(Shape, terrain, Terrain, "heights of a file, and the surface between them")

}  // namespace pileus
