#pragma once

#include <filesystem>
#include <string>

namespace pileus {

/// Writes a file atomically. Throws Error(file) where it cannot be written.
void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace pileus
