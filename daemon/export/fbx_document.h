#pragma once

#include <cstddef>
#include <cstdint>

#include "export/clip/clip.h"
#include "export/fbx_node.h"

// The records of an FBX file that describe it as a whole: who wrote it, axes, units, frame rate and length.
namespace mocap::exports {

/// The time of a frame after frame 0, rounded to a tick of 1/46186158000 s. Whole seconds are counted apart, so that
/// nothing overflows.
std::int64_t fbx_ticks(const Rate& rate, std::size_t frame);

FbxNode fbx_header(const Clip& clip);
FbxNode fbx_global_settings(const Clip& clip);
FbxNode fbx_documents(const Clip& clip);
FbxNode fbx_takes(const Clip& clip);

}  // namespace mocap::exports
