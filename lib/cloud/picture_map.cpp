#include "lib/cloud/picture_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "lib/core/error.h"
#include "lib/core/param_table.h"
#include "lib/image/image_io.h"

namespace pileus {

namespace {

constexpr double kPi = 3.14159265358979323846;

/// More texels than this from one side of a box to the other: all of the picture.
constexpr double kManyTexels = 1 << 24;

/// Rounding of places, in units of the picture's size: some ten operations on terms of that size.
constexpr double kPlaceError = 1e-12;

int wrapped(double texel, int count) {
  const double whole = texel - double(count) * std::floor(texel / double(count));
  return std::min(int(whole), count - 1);
}

/// Rec. 709 weights of linear colours.
float luminance(float r, float g, float b) {
  return 0.2126f * r + 0.7152f * g + 0.0722f * b;
}

const std::vector<float>& channel_values(const Image& image, const std::string& name,
                                         const std::filesystem::path& file) {
  const Channel* channel = image.find(name);
  if (!channel && image.channels.size() < 3 && name != "A") channel = &image.channels.front();  // grey
  if (channel) return channel->values;
  std::vector<std::string> names;
  for (const Channel& known : image.channels) names.push_back(known.name);
  throw Error(ErrorKind::file, file.string(),
              fmt::format("has no channel {}; expected a picture with it; found {}", name, join_or(names)));
}

void check_finite(const std::vector<float>& values, const std::filesystem::path& file) {
  const auto bad = std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
  if (bad == values.end()) return;
  throw Error(ErrorKind::file, file.string(),
              fmt::format("holds {} at pixel {}; expected finite values", *bad, bad - values.begin()));
}

}  // namespace

void PictureMapRecipe::describe(ParamTable& params) {
  params.file("file", file, "the picture");
  params.text("channel", channel, "what of the picture counts")
      .one_of({"luminance", "red", "green", "blue", "alpha"});
  params.boolean("inverse", inverse, "true: 1 - channel");
  params.number("black", levels.x, "", "the channel's value that counts as 0");
  params.number("white", levels.y, "", "the channel's value that counts as 1");
  params.text("projection", projection, "how the picture is laid into space").one_of({"planar", "spherical"});
  params.vector("axis", axis, "", "planar: along it nothing changes; spherical: through the poles");
  params.number("turn_deg", turn_deg, "deg", "turns the picture about the axis");
  params.number("tiles_u", tiles.x, "", "repetitions along the picture's width").above(0).at_most(1e4);
  params.number("tiles_v", tiles.y, "", "repetitions along the picture's height").above(0).at_most(1e4);
}

void PictureMapRecipe::check(std::vector<std::string>& problems, const char* owner) const {
  if (!is_used()) {
    if (*this == PictureMapRecipe{}) return;
    problems.push_back(fmt::format("{} has no file; expected file = \"PICTURE\" in it", owner));
    return;
  }
  if (!(levels.x < levels.y)) {
    problems.push_back(
        fmt::format("{}: black = {} and white = {}; expected black < white", owner, levels.x, levels.y));
  }
  if (!(axis.length() > 0))
    problems.push_back(fmt::format("{}: axis is [0, 0, 0]; expected a direction", owner));
}

PictureMap::PictureMap(const PictureMapRecipe& recipe, const Box3d& box_world) : m_recipe(recipe) {
  const Image image = read_image(recipe.file);
  m_width = image.width, m_height = image.height;
  const std::array<const char*, 3> names{"R", "G", "B"};
  for (size_t c = 0; c < 3; ++c) m_colors[c] = channel_values(image, names[c], recipe.file);
  const auto [r, g, b] = m_colors;
  if (recipe.channel == "luminance") {
    m_values.resize(r.size());
    for (size_t i = 0; i < r.size(); ++i) m_values[i] = luminance(r[i], g[i], b[i]);
  } else {
    const char initial = recipe.channel[0];
    m_values = initial == 'r'   ? r
               : initial == 'g' ? g
               : initial == 'b' ? b
                                : channel_values(image, "A", recipe.file);
  }
  for (const auto& values : m_colors) check_finite(values, recipe.file);
  check_finite(m_values, recipe.file);
  for (float& value : m_values) {
    const double level =
        std::clamp((double(value) - recipe.levels.x) / (recipe.levels.y - recipe.levels.x), 0.0, 1.0);
    value = float(recipe.inverse ? 1 - level : level);
  }
  build_pyramid();

  m_center = box_world.center();
  m_w = recipe.axis.normalized();
  // Right and down as seen along the axis, with the picture's top towards -z where one looks down on the land
  // and towards +y where one looks along it.
  const Vec3d up = std::fabs(m_w.y) > 0.9 ? Vec3d(0, 0, -1) : Vec3d(0, 1, 0);
  const Vec3d right = normalize(std::fabs(m_w.y) > 0.9 ? cross(up, m_w.y < 0 ? -m_w : m_w) : cross(up, m_w));
  const Vec3d down = normalize(-(up - m_w * dot(up, m_w)));
  const double turn = recipe.turn_deg * kPi / 180;
  m_u = right * std::cos(turn) + down * std::sin(turn);
  m_v = down * std::cos(turn) - right * std::sin(turn);
  if (recipe.projection == "spherical") return;
  const Vec3d half = box_world.size() * 0.5;
  const auto extent = [&half](const Vec3d& direction) {
    return 2 * (std::fabs(direction.x) * half.x + std::fabs(direction.y) * half.y +
                std::fabs(direction.z) * half.z);
  };
  m_u *= recipe.tiles.x * m_width / extent(m_u);
  m_v *= recipe.tiles.y * m_height / extent(m_v);
}

void PictureMap::build_pyramid() {
  Level level{m_width, m_height, m_values, m_values};
  m_levels.push_back(level);
  while (level.width > 1 || level.height > 1) {
    const Level& fine = m_levels.back();
    Level coarse;
    coarse.width = (fine.width + 1) / 2, coarse.height = (fine.height + 1) / 2;
    for (int y = 0; y < coarse.height; ++y) {
      for (int x = 0; x < coarse.width; ++x) {
        float lo = std::numeric_limits<float>::infinity(), hi = -lo;
        for (int j = 2 * y; j < std::min(2 * y + 2, fine.height); ++j) {
          for (int i = 2 * x; i < std::min(2 * x + 2, fine.width); ++i) {
            lo = std::min(lo, fine.lo[size_t(j * fine.width + i)]);
            hi = std::max(hi, fine.hi[size_t(j * fine.width + i)]);
          }
        }
        coarse.lo.push_back(lo), coarse.hi.push_back(hi);
      }
    }
    level = coarse;
    m_levels.push_back(std::move(coarse));
  }
}

Vec2d PictureMap::place(const Vec3d& p_world) const {
  const Vec3d offset = p_world - m_center;
  const Vec2d across(dot(offset, m_u), dot(offset, m_v));
  if (m_recipe.projection == "planar") {
    return across + Vec2d(0.5 * m_recipe.tiles.x * m_width - 0.5, 0.5 * m_recipe.tiles.y * m_height - 0.5);
  }
  const double along = dot(offset, m_w);
  const double longitude = std::atan2(across.y, across.x), latitude = std::atan2(along, across.length());
  return {(0.5 + 0.5 * longitude / kPi) * m_recipe.tiles.x * m_width - 0.5,
          (0.5 - latitude / kPi) * m_recipe.tiles.y * m_height - 0.5};
}

PictureMap::Places PictureMap::places(const Box3d& box_world) const {
  const Vec3d half = box_world.size() * 0.5;
  const Vec2d size(m_recipe.tiles.x * m_width, m_recipe.tiles.y * m_height);
  Vec2d reach;
  if (m_recipe.projection == "planar") {
    const auto across = [&half](const Vec3d& m) {
      return std::fabs(m.x) * half.x + std::fabs(m.y) * half.y + std::fabs(m.z) * half.z;
    };
    reach = {across(m_u), across(m_v)};
  } else {
    // The box lies in a ball, the ball in a cone of half angle `apart` about the way to its centre.
    const Vec3d offset = box_world.center() - m_center;
    const double distance = offset.length(), sine = half.length() / distance;
    const double height = std::fabs(dot(offset, m_w)) / distance;
    const double apart = sine < 1 ? std::asin(sine) : kPi;
    const double parallel = std::sqrt(std::max(0.0, 1 - height * height));  // cosine of the latitude
    const bool holds_pole = !(sine < parallel);
    reach = {holds_pole ? size.x : std::asin(sine / parallel) / (2 * kPi) * size.x, apart / kPi * size.y};
    // Places jump where the longitude passes from pi to -pi; the picture need not fit together there.
    const Vec2d middle = place(box_world.center());
    if (middle.x - reach.x < -0.5 || middle.x + reach.x > size.x - 0.5) reach.x = size.x;
  }
  const Vec2d middle = place(box_world.center());
  const Vec3d far = box_world.center() - m_center;
  const double scale = 1 + (std::fabs(far.x) + std::fabs(far.y) + std::fabs(far.z) + half.length()) *
                               (m_u.length() / size.x + m_v.length() / size.y);
  reach += size * (kPlaceError * scale);
  return {{middle.x - reach.x, middle.x + reach.x}, {middle.y - reach.y, middle.y + reach.y}};
}

double PictureMap::sample(const std::vector<float>& values, const Vec2d& place) const {
  const double u = std::floor(place.x), v = std::floor(place.y);
  const int x0 = wrapped(u, m_width), y0 = wrapped(v, m_height);
  const int x1 = x0 + 1 == m_width ? 0 : x0 + 1, y1 = y0 + 1 == m_height ? 0 : y0 + 1;
  const auto at = [&](int x, int y) { return double(values[size_t(y) * size_t(m_width) + size_t(x)]); };
  const double s = place.x - u, t = place.y - v;
  return (1 - t) * ((1 - s) * at(x0, y0) + s * at(x1, y0)) + t * ((1 - s) * at(x0, y1) + s * at(x1, y1));
}

double PictureMap::value(const Vec3d& p_world) const {
  return sample(m_values, place(p_world));
}

Rgb PictureMap::color(const Vec3d& p_world) const {
  const Vec2d at = place(p_world);
  return {sample(m_colors[0], at), sample(m_colors[1], at), sample(m_colors[2], at)};
}

Interval PictureMap::corner_range(const Places& places) const {
  const double first = sample(m_values, {places.u.lo, places.v.lo});
  Interval range{first, first};
  for (const Vec2d& corner :
       {Vec2d(places.u.hi, places.v.lo), Vec2d(places.u.lo, places.v.hi), Vec2d(places.u.hi, places.v.hi)}) {
    const double value = sample(m_values, corner);
    range = hull(range, {value, value});
  }
  return range;
}

Interval PictureMap::texel_range(const Places& places) const {
  const Level& whole = m_levels.back();
  const Interval everything{whole.lo[0], whole.hi[0]};
  const bool is_small = places.u.width() < std::min<double>(kManyTexels, m_width) &&
                        places.v.width() < std::min<double>(kManyTexels, m_height);  // false for NaN
  if (!is_small) return everything;
  // The level on which a handful of squares covers the places.
  const double longest = std::max(places.u.width(), places.v.width()) + 2;
  const size_t level = std::min(size_t(std::ceil(std::log2(longest))) - 1, m_levels.size() - 1);
  const Level& squares = m_levels[level];
  Interval range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  const double step = std::exp2(double(level));
  const auto columns = [step](const Interval& texels, int count) {
    std::vector<int> indices;
    const double last = std::floor(texels.hi) + 1;
    for (double at = std::floor(texels.lo); at <= last;) {
      const int texel = wrapped(at, count), square = int(texel / step);
      indices.push_back(square);
      at += std::min(double(square + 1) * step, double(count)) - texel;  // to the next square, or around
    }
    return indices;
  };
  const std::vector<int> xs = columns(places.u, m_width), ys = columns(places.v, m_height);
  for (const int y : ys) {
    for (const int x : xs) {
      const size_t i = size_t(y) * size_t(squares.width) + size_t(x);
      range = hull(range, {squares.lo[i], squares.hi[i]});
    }
  }
  return range;
}

Interval PictureMap::range(const Box3d& box_world) const {
  const Places at = places(box_world);
  const bool is_one_cell =
      std::floor(at.u.lo) == std::floor(at.u.hi) && std::floor(at.v.lo) == std::floor(at.v.hi);
  const Interval texels = is_one_cell ? corner_range(at) : texel_range(at);
  // Interpolation between texels rounds: by an ulp or two of values up to 1.
  return {std::max(0.0, texels.lo - 1e-15), std::min(1.0 + 1e-15, texels.hi + 1e-15)};
}

}  // namespace pileus
