#pragma once

#include <string>

#include "mocap_client.hpp"

namespace mocap::rokoko {

/// Which subjects a scene has, and at which rate its receiver gets it.
struct SceneOptions {
  std::string subject = {};  ///< empty: all
  double rate_hz = 60.0;     ///< told to the receiver
};

/// Writes a frame as Rokoko's JSON of version 3. `frame` must be in Unity's axes, which are Rokoko's; nullptr: the feed
/// is silent. A tracked subject with a bone "Hips" in HumanBodyBones is an actor, any other tracked subject is a prop
/// with the pose of its root. Subjects that are not tracked are absent. `time_s` becomes the time of the scene if the
/// frame has no exposure time.
///
/// Receivers read every bone of Rokoko's body. A bone that the skeleton lacks, or that is lost, moves rigidly with the
/// nearest bone above it, at its joint. The bones of a hand are written if the skeleton has fingers on this side.
///
/// Source: https://support.rokoko.com/hc/en-us/articles/4410416376977-Custom-Streaming (JSON v3)
std::string write_scene(const ClientFrame* frame, const SceneOptions& options, double time_s);

}  // namespace mocap::rokoko
