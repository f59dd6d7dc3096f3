#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace pileus {

/// The frames that "1-48", "1-48x4" (every fourth), "7" or a list of such, "1,4,10-20", means, in that order.
/// Throws Error(usage) for anything else, and where a frame is named twice.
std::vector<int> parse_frames(const std::string& text);

/// True where a name has a place for a frame number: "smoke.%04d.vdb" or "smoke.%d.vdb".
bool has_frame_number(const std::filesystem::path& name);

/// "smoke.0007.vdb" for "smoke.%04d.vdb" and 7; the name itself where it has no such place. Throws
/// Error(usage) where it has several, or another kind of place.
std::filesystem::path frame_name(const std::filesystem::path& name, int frame);

}  // namespace pileus
