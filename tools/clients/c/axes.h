#pragma once

#include "mocap_client.h"

namespace mocap::client {

/// From the feed's axes (right-handed, x forward, y left, z up, m) to an engine's. New axis i is sign[i] times the
/// feed's axis source[i]; where that mirrors, turns about an axis change their sense.
class Axes {
 public:
  /// `which` is one of enum mocap_axes.
  explicit Axes(int which);
  static bool known(int which) { return which >= MOCAP_AXES_MOCAP && which <= MOCAP_AXES_GLTF; }

  bool identity() const { return identity_; }
  mocap_vec3 place(mocap_vec3 feed) const;  ///< of positions and velocities, in the engine's unit of length
  mocap_quat turn(mocap_quat feed) const;   ///< of rotations
  mocap_vec3 spin(mocap_vec3 feed) const;   ///< of rad/s about axes

 private:
  int source_[3] = {0, 1, 2};
  float sign_[3] = {1.0F, 1.0F, 1.0F};
  float unit_ = 1.0F;   // engine's units in a metre
  float sense_ = 1.0F;  // -1: mirrored
  bool identity_ = true;
};

}  // namespace mocap::client
