#pragma once

#include "mocap_client.h"

namespace mocap::bridge {

/// Rotations as unit quaternions x y z w; product(a, b) applies b first.
inline mocap_quat inverse(mocap_quat q) { return {-q.x, -q.y, -q.z, q.w}; }

inline mocap_quat product(mocap_quat a, mocap_quat b) {
  return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

inline mocap_vec3 rotated(mocap_quat q, mocap_vec3 v) {
  const mocap_quat r = product(product(q, {v.x, v.y, v.z, 0.0F}), inverse(q));
  return {r.x, r.y, r.z};
}

}  // namespace mocap::bridge
