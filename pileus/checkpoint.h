#pragma once

#include <filesystem>
#include <string>

#include "pileus/film.h"
#include "pileus/pileus.h"
#include "pileus/tiles.h"

namespace pileus {

// A checkpoint is an EXR file with the film's planes, its error estimates and "done", which is 1 where the
// pixel is final. Floats come back bit for bit, so a resumed picture equals one that was never interrupted.

/// What pixels depend on: the program, the scene, its files as they are now, and the crop.
std::string fingerprint_of(const Scene& scene, const Crop& crop);

/// Writes what is done so far, atomically. `fingerprint` says which render it belongs to.
void save_checkpoint(const std::filesystem::path& file, const std::string& fingerprint, const Film& film,
                     const TileGrid& tiles);

/// Takes finished tiles from a checkpoint; does nothing where there is none. Throws Error(usage) where the
/// checkpoint belongs to another scene, size or version.
void load_checkpoint(const std::filesystem::path& file, const std::string& fingerprint, Film& film,
                     TileGrid& tiles);

}  // namespace pileus
