#include "integrators/lamp_lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "integrators/kernels/sun_kernel.h"
#include "lib/math/unit_vector.h"

namespace pileus {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Directions that a face looks at, in the grid's local space: away + b * across_b + c * across_c, where b
/// and c lie between these; and how far away from the lamp the grid begins and ends [cells].
struct View {
  Vec3d away, across_b, across_c;
  double b0, b1, c0, c1, z0, z1;
  bool is_whole = false;  ///< no other face is needed
};

std::array<Vec3d, 8> corners_of(const Box3d& box) {
  std::array<Vec3d, 8> corners;
  for (int n = 0; n < 8; ++n)
    corners[size_t(n)] = {n & 1 ? box.max.x : box.min.x, n & 2 ? box.max.y : box.min.y,
                          n & 4 ? box.max.z : box.min.z};
  return corners;
}

/// One view of all of a box, where it is not seen at too wide an angle.
std::optional<View> whole_view(const Box3d& box, const Vec3d& lamp) {
  constexpr double kWidest = 1.2;  // tangent
  const std::optional<Vec3d> away = unit_vector(box.center() - lamp);
  if (!away) return std::nullopt;
  const Vec3d other = std::abs(away->x) < 0.6 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  View view;
  view.away = *away;
  view.across_b = normalize(cross(other, view.away));
  view.across_c = cross(view.away, view.across_b);
  view.is_whole = true;
  view.b0 = view.c0 = view.z0 = kInfinity;
  view.b1 = view.c1 = view.z1 = -kInfinity;
  for (const Vec3d& corner : corners_of(box)) {
    const Vec3d q = corner - lamp;
    const double z = dot(q, view.away), b = dot(q, view.across_b) / z, c = dot(q, view.across_c) / z;
    if (!(z > 0.0 && std::max(std::abs(b), std::abs(c)) <= kWidest)) return std::nullopt;
    view.b0 = std::min(view.b0, b), view.b1 = std::max(view.b1, b);
    view.c0 = std::min(view.c0, c), view.c1 = std::max(view.c1, c);
    view.z0 = std::min(view.z0, z), view.z1 = std::max(view.z1, z);
  }
  return view;
}

/// Tangents b / z for b and z in these intervals, as far as they lie in [-1, 1]; z0 may be 0.
Segment tangents(double b0, double b1, double z0, double z1) {
  const auto quotient = [&](double b, double z) { return z > 0.0 ? b / z : b * kInfinity; };
  const double lo = b0 >= 0.0 ? b0 / z1 : quotient(b0, z0), hi = b1 <= 0.0 ? b1 / z1 : quotient(b1, z0);
  return {std::max(lo, -1.0), std::min(hi, 1.0)};
}

/// What a face of the cube around the lamp sees of a box.
std::optional<View> cube_view(const Box3d& box, const Vec3d& lamp, int axis, bool is_up) {
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  View view;
  view.away = view.across_b = view.across_c = Vec3d(0.0);
  view.away[axis] = is_up ? 1.0 : -1.0;
  view.across_b[b] = view.across_c[c] = 1.0;
  view.z0 = std::max(0.0, is_up ? box.min[axis] - lamp[axis] : lamp[axis] - box.max[axis]);
  view.z1 = is_up ? box.max[axis] - lamp[axis] : lamp[axis] - box.min[axis];
  if (!(view.z1 > 0.0)) return std::nullopt;
  const Segment seen_b = tangents(box.min[b] - lamp[b], box.max[b] - lamp[b], view.z0, view.z1),
                seen_c = tangents(box.min[c] - lamp[c], box.max[c] - lamp[c], view.z0, view.z1);
  if (!(seen_b.t0 <= seen_b.t1 && seen_c.t0 <= seen_c.t1)) return std::nullopt;
  view.b0 = seen_b.t0, view.b1 = seen_b.t1, view.c0 = seen_c.t0, view.c1 = seen_c.t1;
  return view;
}

std::vector<View> views_of(const Box3d& box, const Vec3d& lamp) {
  if (box.isEmpty()) return {};
  if (const auto whole = whole_view(box, lamp)) return {*whole};
  std::vector<View> views;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool is_up : {false, true})
      if (const auto view = cube_view(box, lamp, axis, is_up)) views.push_back(*view);
  }
  return views;
}

/// The nodes of a face.
struct Frame {
  LampSweep sweep;
  double bricks[3] = {0.0, 0.0, 0.0};
  double lo_u = -kInfinity, hi_u = kInfinity, lo_v = -kInfinity, hi_v = kInfinity;

  double table_size() const { return bricks[0] * bricks[1] * bricks[2]; }
};

Frame frame_of(const MarchGrid& grid, const Vec3d& lamp, const View& view, const LatticeOptions& options) {
  // Close to the lamp, where its light is strongest, few cells make much of the depth: they are to be small
  // beside the distances.
  constexpr double kFewestLines = 24.0, kFewestNodes = 16.0;
  const double across = options.spacing.across,
               along = view.is_whole ? options.spacing.along
                                     : std::min(options.spacing.along, view.z1 / kFewestNodes);
  const double tangent = std::min(across / view.z1, 1.0 / kFewestLines);  // between lines
  Frame frame;
  LampSweep& sweep = frame.sweep;
  sweep.grid = &grid;
  sweep.lamp = lamp;
  // A line of zeros on either side.
  sweep.ahead =
      along * (view.away + (view.b0 - tangent) * view.across_b + (view.c0 - tangent) * view.across_c);
  sweep.eu = along * tangent * view.across_b;
  sweep.ev = along * tangent * view.across_c;
  sweep.w0 = view.z0 / along;
  sweep.steps = int(std::ceil(std::max(along, along / across) - 1e-6));
  sweep.enough = std::min(options.enough, SunLattice::kDeepest);
  sweep.is_everywhere = options.is_everywhere;
  const auto bricks = [](double cells) { return std::ceil(cells / SunLattice::kBrickCells); };
  frame.bricks[0] = bricks(std::ceil((view.b1 - view.b0) / tangent) + 2.0);
  frame.bricks[1] = bricks(std::ceil((view.c1 - view.c0) / tangent) + 2.0);
  frame.bricks[2] = std::max(1.0, bricks((view.z1 - view.z0) / along));
  if (view.is_whole) return frame;
  // Faces share their edges, and what lies on these by rounding.
  constexpr double kMargin = 0.01;
  frame.lo_u = (-1.0 - view.b0) / tangent + 1.0 - kMargin;
  frame.hi_u = (1.0 - view.b0) / tangent + 1.0 + kMargin;
  frame.lo_v = (-1.0 - view.c0) / tangent + 1.0 - kMargin;
  frame.hi_v = (1.0 - view.c0) / tangent + 1.0 + kMargin;
  return frame;
}

std::vector<Frame> frames_of(const MarchGrid& grid, const Vec3d& lamp_world, const LatticeOptions& options) {
  std::vector<Frame> frames;
  if (!(grid.extinction > 0.0)) return frames;
  const Vec3d lamp = grid.local_from_world.point(lamp_world);
  for (const View& view : views_of(grid.bounds, lamp)) frames.push_back(frame_of(grid, lamp, view, options));
  return frames;
}

}  // namespace

double lamp_faces_bytes(const MarchGrid& grid, const Vec3d& lamp_world, const LatticeOptions& options) {
  double table = 0.0;
  for (const Frame& frame : frames_of(grid, lamp_world, options)) table += frame.table_size();
  const double bricks = options.is_everywhere ? table : std::min(table, bricks_with_density(grid, options));
  return table * sizeof(int32_t) + bricks * brick_bytes();
}

std::vector<LampFace> build_lamp_faces(const MarchGrid& grid, const Vec3d& lamp_world,
                                       const LatticeOptions& options, bool& fits, uint64_t* samples) {
  std::vector<LampFace> faces;
  double room = options.most_bytes;
  for (const Frame& frame : frames_of(grid, lamp_world, options)) {
    const LampSweep& sweep = frame.sweep;
    const Affine map =
        lattice_from_local(sweep.lamp + sweep.w0 * sweep.ahead, sweep.eu, sweep.ev, sweep.ahead) *
        grid.local_from_world;
    const auto sweep_bricks = [&](const Vec2i& first, const Vec2i& end, SunBricks& bricks) {
      sweep_lamp_bricks(sweep, first, end, bricks);
    };
    LampFace face;
    face.depths = fill_lattice(map, frame.bricks, sweep.enough, room, sweep_bricks, samples);
    face.w0 = sweep.w0;
    face.lo_u = frame.lo_u, face.hi_u = frame.hi_u, face.lo_v = frame.lo_v, face.hi_v = frame.hi_v;
    fits &= face.depths.bricks.x > 0;
    room -= double(face.depths.memory_bytes());
    faces.push_back(std::move(face));
  }
  return faces;
}

double lamp_depth(const std::vector<LampFace>& faces, const Vec3d& p_world) {
  double depth = 0.0;
  for (const LampFace& face : faces) {
    const Vec3d p = face.depths.lattice_from_world.point(p_world);
    const double z = p.z + face.w0, u = p.x / z, v = p.y / z;
    const bool is_its_own = z > 0.0 && u >= face.lo_u && u <= face.hi_u && v >= face.lo_v && v <= face.hi_v;
    if (is_its_own) depth = depth_at(face.depths, {u, v, p.z});
  }
  return depth;
}

}  // namespace pileus
