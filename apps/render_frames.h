#pragma once

#include "apps/render_command.h"

namespace pileus {

/// Renders the frames of a command one after the other. Finished pictures say in their comments what they
/// were made of; with `resume`, frames whose pictures are whole and made of the same are left alone. An
/// interrupted frame leaves a checkpoint. The report is one for all frames. Throws Error, with the frame's
/// number.
void render_frames(const RenderCommand& command);

}  // namespace pileus
