#pragma once

#include <cstddef>
#include <string>

#include "export/clip/clip.h"

namespace mocap::exports::test {

/// A clip of 45 frames at 29.97 Hz that begins at frame 100 of its take: two persons and a prop that move far and fast.
/// The chest of both persons passes through rotations of 90 degrees (gimbal lock), the roots turn more than a full
/// turn. Lost samples have NaN as pose:
///
/// * `Anna`: the bone LeftLowArm in frames 10 to 15.
/// * `Ben Two`: all bones in frames 0 to 4 and 20 to 24; the joint of the head moves relative to its parent.
/// * `Anna` again, the prop: from frame 30 to the end.
Clip moving_clip();

/// The pose of a bone without gaps, which `moving_clip` has in the frames in which the bone is known.
Pose sample_pose(const Clip& clip, std::size_t subject, std::size_t bone, std::size_t frame);

/// The frame whose pose a file must have in `frame`: the last one in which the bone is known; before that, the first.
std::size_t shown_frame(std::size_t subject, const std::string& bone, std::size_t frame);

}  // namespace mocap::exports::test
