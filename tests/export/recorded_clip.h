#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "export/clip/clip.h"

namespace mocap::exports::test {

/// The world poses of all bones of a subject in one frame. A lost bone has NaN, and so have the bones below it.
std::vector<Pose> world_poses(const ClipSubject& subject, std::size_t frame);

/// Records a clip as a take (MCAP), as the daemon would: each frame is a snapshot, the markers are rigid on their
/// bones, and the markers of lost bones are lost. Subjects get the names `names`. Stops the process if it cannot be
/// written.
void record(const Clip& clip, const std::vector<std::string>& names, const std::filesystem::path& path);

}  // namespace mocap::exports::test
