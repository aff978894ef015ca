#include "axes.h"

namespace mocap::client {
namespace {

// One row for each engine, in the order of enum mocap_axes.
constexpr AxisChange kChanges[] = {
    {{0, 1, 2}, {1.0F, 1.0F, 1.0F}, 1.0F, 1.0F},      // forward, left, up
    {{1, 2, 0}, {-1.0F, 1.0F, 1.0F}, 1.0F, -1.0F},    // Unity: right, up, forward
    {{0, 1, 2}, {1.0F, -1.0F, 1.0F}, 100.0F, -1.0F},  // Unreal: forward, right, up, cm
    {{1, 2, 0}, {-1.0F, 1.0F, -1.0F}, 1.0F, 1.0F},    // Godot: right, up, backward
    {{1, 2, 0}, {1.0F, 1.0F, 1.0F}, 1.0F, 1.0F},      // glTF: left, up, forward
};

}  // namespace

Axes::Axes(int which) : change_(kChanges[which]), identity_(which == MOCAP_AXES_MOCAP) {}

Axes::Axes(const AxisChange& change) : change_(change), identity_(false) {}

mocap_vec3 Axes::place(mocap_vec3 feed) const {
  const float from[3] = {feed.x, feed.y, feed.z};
  return {change_.unit * change_.sign[0] * from[change_.source[0]],
          change_.unit * change_.sign[1] * from[change_.source[1]],
          change_.unit * change_.sign[2] * from[change_.source[2]]};
}

mocap_vec3 Axes::spin(mocap_vec3 feed) const {
  const float from[3] = {feed.x, feed.y, feed.z};
  return {change_.sense * change_.sign[0] * from[change_.source[0]],
          change_.sense * change_.sign[1] * from[change_.source[1]],
          change_.sense * change_.sign[2] * from[change_.source[2]]};
}

// Converts the rotation axis like a vector. A reflection reverses the sense of rotation.
mocap_quat Axes::turn(mocap_quat feed) const {
  const mocap_vec3 axis = spin({feed.x, feed.y, feed.z});
  return {axis.x, axis.y, axis.z, feed.w};
}

}  // namespace mocap::client
