/// A picture.
///
///   file         .png, .jpg, .tif, .exr, .hdr and what else OpenImageIO reads; values 0 .. 1
///   encoding     auto: whole numbers are display values, floats linear; srgb or linear: all are that
///   projection   planar (default), spherical or cylindrical
///   tiles_u, tiles_v   how often it repeats, from left to right and from top to bottom; default 1
///   wrap_u, wrap_v     beyond its borders: repeat (default), mirror or clamp
///   filter       trilinear (default), bilinear or nearest
///   opacity      alpha (default), luminance, inverse_luminance or full
///   scale, rotate_deg, translate   where it is put; before that, planar pictures fill the unit square of the
///                xz plane around the origin, spherical ones surround the origin, cylindrical ones are 1 high
///
///   [texture.bricks]
///   type = "image"
///   file = "bricks.png"
///   scale = [2, 1, 2]         # 2 m x 2 m, seen from above
///
/// All the way round the axis a picture has no border: left and right are joined there. At the poles of a
/// sphere it ends. ref: docs/textures.md; Williams 1983 (mip-maps)
#include <algorithm>
#include <filesystem>
#include <utility>

#include "lib/texture/picture_texels.h"
#include "shaders_cpu/texture/laid_out.h"

namespace pileus {
namespace {

Wrap wrap_named(const std::string& name) {
  if (name == "clamp") return Wrap::clamp;
  return name == "mirror" ? Wrap::mirror : Wrap::repeat;
}

struct ImageTexture final : Texture {
  std::filesystem::path m_file;
  std::string m_encoding = "auto", m_wrap_u = "repeat", m_wrap_v = "repeat", m_filter_name = "trilinear";
  Layout m_layout;

  MipPyramid m_pyramid;
  bool m_is_opaque = true;
  Projection m_projection = Projection::planar;
  Wraps m_wraps;
  TextureFilter m_filter = TextureFilter::trilinear;

  void describe_pattern(ParamTable& params) override {
    params.file("file", m_file, "the picture").required();
    params.text("encoding", m_encoding, "what its values mean").one_of({"auto", "srgb", "linear"});
    m_layout.describe(params);
    params.text("wrap_u", m_wrap_u, "what lies left and right of it").one_of({"repeat", "mirror", "clamp"});
    params.text("wrap_v", m_wrap_v, "what lies above and below it").one_of({"repeat", "mirror", "clamp"});
    params.text("filter", m_filter_name, "how a part of it becomes one colour")
        .one_of({"trilinear", "bilinear", "nearest"});
  }

  void commit_pattern(std::vector<std::string>&) override {
    m_projection = m_layout.projection();
    m_wraps = {wrap_named(m_wrap_u), wrap_named(m_wrap_v)};
    if (m_layout.is_closed_around() && m_wraps.u == Wrap::clamp) m_wraps.u = Wrap::repeat;
    if (m_layout.ends_at_poles()) m_wraps.v = Wrap::clamp;
    m_filter = m_filter_name == "nearest"    ? TextureFilter::nearest
               : m_filter_name == "bilinear" ? TextureFilter::bilinear
                                             : TextureFilter::trilinear;
    if (m_file.empty()) return;  // the reader has complained
    const PictureEncoding encoding = m_encoding == "srgb"     ? PictureEncoding::srgb
                                     : m_encoding == "linear" ? PictureEncoding::linear
                                                              : PictureEncoding::by_file;
    TexelGrid texels = read_texels(m_file, encoding);
    m_is_opaque = std::all_of(texels.texels.begin(), texels.texels.end(),
                              [](const Texel& texel) { return texel.w == 1.0F; });
    m_pyramid = MipPyramid(std::move(texels));
  }

  bool is_pattern_opaque() const override { return m_is_opaque; }

  TextureValue pattern(const TexturedPoint& point) const override {
    const auto seen = [&](const Layout::Place& place) {
      return filtered(m_pyramid, place.uv, place.area, m_wraps, m_filter);
    };
    const Texel texel = m_filter == TextureFilter::nearest ? seen(m_layout.place(m_projection, point))
                                                           : m_layout.mean(m_projection, point, seen);
    if (!(texel.w > 0.0F)) return {Rgb(0.0), 0.0};
    const auto share = [&](float color) { return std::min(1.0, double(color) / double(texel.w)); };
    return {{share(texel.x), share(texel.y), share(texel.z)}, std::min(1.0, double(texel.w))};
  }
};

}  // namespace

PILEUS_PLUGIN(Texture, image, ImageTexture, "a picture")

}  // namespace pileus
