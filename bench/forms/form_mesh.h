#pragma once

#include "lib/freeform/free_form.h"
#include "lib/geom/triangle_mesh.h"

namespace pileus::bench {

/// The surface of a solid as triangles of about one edge length, closed: surface nets (Gibson 1998), whose
/// vertices are then moved onto the surface. Space without surface is left out by bounds of the form.
///   form: with an end
///   edge: of the cells [m]
MeshData mesh_of(const FreeForm& form, double edge);

}  // namespace pileus::bench
