#pragma once

#include "mocap_client.h"

namespace mocap::client {

/// The axes of a receiver: its axis i is sign[i] times axis source[i] of the feed (0 forward, 1 left, 2 up).
struct AxisChange {
  int source[3];
  float sign[3];
  float unit;   ///< length units of the receiver per metre
  float sense;  ///< determinant of the signed permutation; -1: a reflection
};

/// Converts from the axes of the feed (right-handed, x forward, y left, z up, m) to the axes of an engine. If the
/// conversion is a reflection, the sense of rotations changes.
class Axes {
 public:
  /// `which` is one of enum mocap_axes.
  explicit Axes(int which);
  explicit Axes(const AxisChange& change);
  static bool known(int which) { return which >= MOCAP_AXES_MOCAP && which <= MOCAP_AXES_GLTF; }

  bool identity() const { return identity_; }
  mocap_vec3 place(mocap_vec3 feed) const;  ///< converts positions and velocities, to the length unit of the engine
  mocap_quat turn(mocap_quat feed) const;   ///< converts rotations
  mocap_vec3 spin(mocap_vec3 feed) const;   ///< converts angular velocities, rad/s

 private:
  AxisChange change_;
  bool identity_;
};

}  // namespace mocap::client
