#include "lib/volume/instanced_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "lib/core/error.h"
#include "lib/geom/box_index.h"
#include "lib/math/box.h"
#include "lib/math/offset_point.h"

namespace pileus {
namespace {

using Controls = std::array<double, 4>;

double between(double a, double b, double share) {
  return (1.0 - share) * a + share * b;
}

/// The part of a cubic below a share of its stretch: de Casteljau's scheme, means of control values only.
Controls before(const Controls& b, double share) {
  const double ab = between(b[0], b[1], share), bc = between(b[1], b[2], share),
               cd = between(b[2], b[3], share);
  const double abc = between(ab, bc, share), bcd = between(bc, cd, share);
  return {b[0], ab, abc, between(abc, bcd, share)};
}

Controls after(const Controls& b, double share) {
  const Controls reversed = before({b[3], b[2], b[1], b[0]}, 1.0 - share);
  return {reversed[3], reversed[2], reversed[1], reversed[0]};
}

/// A piece between two places on it.
DensityPiece part_of(const DensityPiece& piece, double t0, double t1) {
  PILEUS_CHECK(piece.rate == 0.0);
  DensityPiece part{t0, t1, piece.rho};
  const double h = piece.t1 - piece.t0;
  if (t1 < piece.t1) part.rho = before(part.rho, std::clamp((t1 - piece.t0) / h, 0.0, 1.0));
  if (t0 > piece.t0) part.rho = after(part.rho, std::clamp((t0 - piece.t0) / (t1 - piece.t0), 0.0, 1.0));
  return part;
}

/// The box of a box that is moved, turned or stretched, larger by what rounding may do.
Box3d placed_box(const Affine& placed_from_grid, const Box3d& box) {
  if (box.isEmpty()) return box;
  const Box3d result = box_around(placed_from_grid, box);
  double reach = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d along(0.0);
    along[axis] = std::max(std::fabs(box.min[axis]), std::fabs(box.max[axis]));
    reach = std::max(reach, length(placed_from_grid.direction(along)));
  }
  const Vec3d margin(surface_error(3.0 * reach + length(placed_from_grid.point(Vec3d(0.0)))));
  return {result.min - margin, result.max + margin};
}

/// How many boxes have a point in common, at most. Where they do, they have one with the least x of one of
/// them.
size_t most_overlapping(const std::vector<Box3d>& boxes) {
  std::vector<Box3d> sorted;
  for (const Box3d& box : boxes) {
    if (!box.isEmpty()) sorted.push_back(box);
  }
  std::sort(sorted.begin(), sorted.end(), [](const Box3d& a, const Box3d& b) { return a.min.x < b.min.x; });
  double widest = 0.0;
  for (const Box3d& box : sorted) widest = std::max(widest, box.max.x - box.min.x);
  size_t most = 0, first = 0;
  for (size_t i = 0; i < sorted.size(); ++i) {
    const Box3d& box = sorted[i];
    size_t count = 1;
    while (sorted[first].min.x < box.min.x - widest) ++first;
    for (size_t j = first; j < sorted.size() && sorted[j].min.x <= box.min.x; ++j)
      count += i != j && sorted[j].intersects(box) ? 1 : 0;
    most = std::max(most, count);
  }
  return most;
}

class InstancedField final : public DensityField {
 public:
  InstancedField(std::shared_ptr<const DensityField> grid, const std::vector<Affine>& placed_from_grid)
      : m_grid(std::move(grid)) {
    const Box3d box = m_grid->bounds();
    for (const Affine& placed : placed_from_grid) {
      const Affine grid_from_placed = placed.inverse();
      m_grid_from_placed.push_back(grid_from_placed);
      m_boxes.push_back(placed_box(placed, box));
      m_bounds.extendBy(m_boxes.back());
      for (const Affine& index_from_grid : m_grid->places())
        m_places.push_back(index_from_grid * grid_from_placed);
    }
    m_index = BoxIndex(m_boxes);
    m_max_density = m_grid->max_density() * double(most_overlapping(m_boxes));
    for (const Affine& place : m_places) m_feature_size = std::min(m_feature_size, shortest_edge(place));
  }

  Box3d bounds() const override { return m_bounds; }
  double max_density() const override { return m_max_density; }
  double feature_size() const override { return m_feature_size; }

  bool has_bricks() const override { return true; }
  const BrickGrid* bricks() const override { return m_grid->bricks(); }
  std::shared_ptr<const BrickPyramid> quantized_bricks() const override { return m_grid->quantized_bricks(); }
  const Affine& index_from_world() const override { return m_places.front(); }
  std::span<const Affine> places() const override { return m_places; }

  void append_pieces(const Ray& ray, Segment segment, std::vector<DensityPiece>& pieces,
                     FieldCounters& counters) const override {
    std::vector<DensityPiece> sum, of_one;
    for (const Meeting& meeting : meetings(ray, segment)) {
      of_one.clear();
      m_grid->append_pieces(ray_in_grid(ray, meeting.place), meeting.inside, of_one, counters);
      add_pieces(sum, of_one);
    }
    pieces.insert(pieces.end(), sum.begin(), sum.end());
  }

  double column(const Ray& ray, Segment segment, double enough, FieldCounters& counters) const override {
    double sum = 0.0;
    for (const Meeting& meeting : meetings(ray, segment)) {
      sum += m_grid->column(ray_in_grid(ray, meeting.place), meeting.inside, enough - sum, counters);
      if (sum >= enough) break;
    }
    return sum;
  }

  void sample(const Ray& ray, double t0, double dt, std::span<double> rho,
              FieldCounters& counters) const override {
    std::fill(rho.begin(), rho.end(), 0.0);
    if (rho.empty()) return;
    const double last = double(rho.size() - 1);
    const Segment all{t0, std::nextafter(t0 + last * dt, std::numeric_limits<double>::infinity())};
    std::vector<double> of_one;
    for (const Meeting& meeting : meetings(ray, all)) {
      const size_t first = size_t(std::clamp(std::floor((meeting.inside.t0 - t0) / dt), 0.0, last)),
                   end = size_t(std::clamp(std::ceil((meeting.inside.t1 - t0) / dt), 0.0, last)) + 1;
      of_one.resize(end - first);
      m_grid->sample(ray_in_grid(ray, meeting.place), t0 + double(first) * dt, dt, of_one, counters);
      for (size_t i = first; i < end; ++i) rho[i] += of_one[i - first];
    }
  }

 private:
  /// A place whose box a ray meets.
  struct Meeting {
    Segment inside;
    size_t place;
  };

  /// Near ones first.
  std::vector<Meeting> meetings(const Ray& ray, Segment segment) const {
    std::vector<Meeting> found;
    m_index.visit(ray, segment, [&](size_t place, double&) {
      const Segment inside = clip_to_box(ray, segment, m_boxes[place]);
      if (!inside.empty()) found.push_back({inside, place});
      return true;
    });
    std::sort(found.begin(), found.end(), [](const Meeting& a, const Meeting& b) {
      return a.inside.t0 != b.inside.t0 ? a.inside.t0 < b.inside.t0 : a.place < b.place;
    });
    return found;
  }

  /// Its d is not normalised: t stays the length in world space [m].
  Ray ray_in_grid(const Ray& ray, size_t place) const {
    const Affine& map = m_grid_from_placed[place];
    return {map.point(ray.o), map.direction(ray.d)};
  }

  static double shortest_edge(const Affine& index_from_world) {
    const Affine world_from_index = index_from_world.inverse();
    double shortest = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      Vec3d edge(0.0);
      edge[axis] = 1.0;
      shortest = std::min(shortest, length(world_from_index.direction(edge)));
    }
    return shortest;
  }

  std::shared_ptr<const DensityField> m_grid;
  std::vector<Affine> m_grid_from_placed, m_places;
  std::vector<Box3d> m_boxes;  ///< of each m_grid_from_placed, in the world
  BoxIndex m_index;
  Box3d m_bounds;
  double m_max_density = 0.0, m_feature_size = std::numeric_limits<double>::infinity();
};

}  // namespace

std::shared_ptr<const DensityField> make_instanced_field(std::shared_ptr<const DensityField> grid,
                                                         const std::vector<Affine>& placed_from_grid) {
  PILEUS_CHECK(grid->has_bricks() && !placed_from_grid.empty());
  return std::make_shared<InstancedField>(std::move(grid), placed_from_grid);
}

void add_pieces(std::vector<DensityPiece>& sum, const std::vector<DensityPiece>& others) {
  if (others.empty()) return;
  const auto overlap = std::partition_point(
      sum.begin(), sum.end(), [&](const DensityPiece& piece) { return piece.t1 <= others.front().t0; });
  const std::vector<DensityPiece> rest(overlap, sum.end());
  sum.erase(overlap, sum.end());
  auto a = rest.begin();
  auto b = others.begin();
  for (double t = -std::numeric_limits<double>::infinity(); a != rest.end() || b != others.end();) {
    constexpr double kNever = std::numeric_limits<double>::infinity();
    const auto start = [&](auto piece, const auto& list) {
      return piece == list.end() ? kNever : std::max(piece->t0, t);
    };
    const double start_a = start(a, rest), start_b = start(b, others);
    t = std::min(start_a, start_b);
    // Up to where the one that is here ends or the other begins.
    const auto stop = [&](auto piece, double own_start) { return own_start > t ? own_start : piece->t1; };
    const double end = std::min(stop(a, start_a), stop(b, start_b));
    DensityPiece piece = start_a <= t ? part_of(*a, t, end) : part_of(*b, t, end);
    if (start_a <= t && start_b <= t) {
      const Controls more = part_of(*b, t, end).rho;
      for (size_t k = 0; k < more.size(); ++k) piece.rho[k] += more[k];
    }
    sum.push_back(piece);
    t = end;
    if (a != rest.end() && a->t1 <= t) ++a;
    if (b != others.end() && b->t1 <= t) ++b;
  }
}

}  // namespace pileus
