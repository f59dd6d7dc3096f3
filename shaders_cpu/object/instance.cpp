/// Another object once more, or many times, in other places: for the memory of one.
///
///   of           name of the object
///   scale, rotate_deg, translate   where it is put, beyond where the object stands itself
///   placements   a list of these, for many
///   file         .csv with lines x,y,z,scale,turn: [m], a factor, [deg] about the y axis; for very many
///   shader       what light does on the surface; default: the shader of the object
///
///   [object.fir]
///   type = "mesh"
///   file = "fir.ply"
///   hidden = true        # only its instances are seen
///
///   [object.forest]
///   type = "instance"
///   of = "fir"
///   file = "forest.csv"
///
/// An instance may be of instances. scale, rotate_deg and translate move all placements together.
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/param_table.h"
#include "lib/scene/formed_shape.h"
#include "lib/scene/object_space.h"
#include "lib/scene/placements.h"
#include "lib/scene/shape_index.h"

namespace pileus {
namespace {

/// One of many: its place, and what stands there.
struct Placed final : Shape {
  std::shared_ptr<const Shape> m_object;
  ObjectSpace m_space;
  Box3d m_bounds;

  Placed(std::shared_ptr<const Shape> object, const Affine& world_from_object)
      : m_object(std::move(object)),
        m_space(world_from_object),
        m_bounds(m_space.world_box(m_object->bounds())) {}

  void describe_form(ParamTable&) override {}
  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const override {
    return m_space.intersect(
        ray, segment, [&](const Ray& local, Segment part) { return m_object->intersect(local, part); });
  }
  Box3d bounds() const override { return m_bounds; }
};

/// All placements of one object.
struct Instances final : Shape {
  std::vector<Placed> m_placed;
  ShapeIndex m_index;
  Box3d m_bounds;

  explicit Instances(std::vector<Placed> placed) : m_placed(std::move(placed)) {
    std::vector<const Shape*> shapes;
    for (const Placed& one : m_placed) {
      shapes.push_back(&one);
      m_bounds.extendBy(one.bounds());
    }
    m_index = ShapeIndex(std::move(shapes));
  }
  Instances(const Instances&) = delete;  // the index points into it
  Instances& operator=(const Instances&) = delete;

  void describe_form(ParamTable&) override {}
  std::optional<SurfaceHit> intersect(const Ray& ray, Segment segment) const override {
    const auto hit = m_index.nearest(ray, segment);
    if (!hit) return std::nullopt;
    return SurfaceHit{hit->t, hit->n, hit->error, hit->is_inside};
  }
  Box3d bounds() const override { return m_bounds; }
};

struct Instance final : FormedShape {
  std::string m_of;
  Placements m_places;

  void describe_form(ParamTable& params) override {
    params.reference("of", m_of, kKind, "the object that stands here, too").required();
    m_places.describe(params);
  }
  std::string default_shader() const override { return ""; }

  std::shared_ptr<const Shape> build(const ShapeSources& sources) const override {
    const std::shared_ptr<const Shape> object = sources.object(m_of);
    const Box3d box = object->bounds();
    if (!box.isEmpty() && !(std::isfinite(length(box.min)) && std::isfinite(length(box.max)))) {
      throw Error(ErrorKind::scene, SourceLoc{},
                  fmt::format("object \"{}\" has no end; expected one that has", m_of));
    }
    std::vector<Placed> placed;
    for (const Affine& world_from_object : m_places.placed_from_original())
      placed.emplace_back(object, world_from_object);
    auto built = std::make_shared<Instances>(std::move(placed));
    built->shader = shader ? shader : object->shader;
    return built;
  }

  /// Nothing stands anywhere before it is built.
  std::optional<SurfaceHit> intersect(const Ray&, Segment) const override { return std::nullopt; }
  Box3d bounds() const override { return {}; }
};

}  // namespace

PILEUS_PLUGIN(Shape, instance, Instance, "another object in other places")

}  // namespace pileus
