#pragma once

#include <filesystem>

namespace mocap {

/// Gives a file another name on the same file system, and never replaces an existing file. Returns false and leaves the
/// reason in errno: EEXIST if `to` exists.
bool move_without_replacing(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace mocap
