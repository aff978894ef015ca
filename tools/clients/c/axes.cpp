#include "axes.h"

namespace mocap::client {
namespace {

struct Change {
  int source[3];
  float sign[3];
  float unit;
  float sense;  // the determinant of the signed permutation
};

// The feed's axes are 0 forward, 1 left, 2 up. One row an engine, in the order of enum mocap_axes.
constexpr Change kChanges[] = {
    {{0, 1, 2}, {1.0F, 1.0F, 1.0F}, 1.0F, 1.0F},      // forward, left, up
    {{1, 2, 0}, {-1.0F, 1.0F, 1.0F}, 1.0F, -1.0F},    // Unity: right, up, forward
    {{0, 1, 2}, {1.0F, -1.0F, 1.0F}, 100.0F, -1.0F},  // Unreal: forward, right, up, cm
    {{1, 2, 0}, {-1.0F, 1.0F, -1.0F}, 1.0F, 1.0F},    // Godot: right, up, backward
    {{1, 2, 0}, {1.0F, 1.0F, 1.0F}, 1.0F, 1.0F},      // glTF: left, up, forward
};

}  // namespace

Axes::Axes(int which) : unit_(kChanges[which].unit), sense_(kChanges[which].sense), identity_(which == 0) {
  for (int i = 0; i < 3; ++i) {
    source_[i] = kChanges[which].source[i];
    sign_[i] = kChanges[which].sign[i];
  }
}

mocap_vec3 Axes::place(mocap_vec3 feed) const {
  const float from[3] = {feed.x, feed.y, feed.z};
  return {unit_ * sign_[0] * from[source_[0]], unit_ * sign_[1] * from[source_[1]],
          unit_ * sign_[2] * from[source_[2]]};
}

mocap_vec3 Axes::spin(mocap_vec3 feed) const {
  const float from[3] = {feed.x, feed.y, feed.z};
  return {sense_ * sign_[0] * from[source_[0]], sense_ * sign_[1] * from[source_[1]],
          sense_ * sign_[2] * from[source_[2]]};
}

// A turn by an angle about an axis: the axis moves along, and a mirror turns its sense round.
mocap_quat Axes::turn(mocap_quat feed) const {
  const mocap_vec3 axis = spin({feed.x, feed.y, feed.z});
  return {axis.x, axis.y, axis.z, feed.w};
}

}  // namespace mocap::client
