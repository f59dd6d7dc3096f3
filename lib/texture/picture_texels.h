#pragma once

#include <filesystem>

#include "lib/image/image_io.h"
#include "lib/texture/mip_pyramid.h"

namespace pileus {

/// Reads a picture in colour or grey, with or without alpha, as texels.
/// errors: as read_image; Error(file) where it has neither R, G and B nor Y, where a value lies outside 0 ..
/// 1
///         (a surface that gives back more than it gets is none), or where its pyramid would take more than
///         the memory budget
TexelGrid read_texels(const std::filesystem::path& file, PictureEncoding encoding);

}  // namespace pileus
