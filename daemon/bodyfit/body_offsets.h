#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::bodyfit {

/// What a fit may change of a marker set: where joints and markers sit on the body.
struct BodyOffsets {
  std::vector<Eigen::Vector3d> bones_m;    ///< rest offset, by bone; the root's is never looked at
  std::vector<Eigen::Vector3d> markers_m;  ///< by marker
};

BodyOffsets offsets_of(const MarkerSet& set);
void apply_offsets(const BodyOffsets& offsets, MarkerSet& set);

/// One instant of one body: where its named markers were, and a pose that explains it.
struct BodyInstant {
  std::vector<Eigen::Vector3d> seen_m;  ///< by marker, world; not finite: not seen
  std::vector<double> trust;            ///< by marker, 0 to 1: one over how much its variance is larger than usual
  std::vector<Pose> locals;             ///< by bone: the pose; but for the root only the turns are looked at
  std::vector<std::uint8_t> at_rest;    ///< by bone: held as in the rest pose (of the root: upright); else 0
};

/// An instant of nothing seen, in rest pose.
BodyInstant empty_instant(const MarkerSet& set);

/// How the pose of an instant is judged.
struct InstantCost {
  double sigma_m = 0.003;            ///< of a marker from its place on the body
  double outlier_m = 0.03;           ///< a marker further off than this counts less and less
  double rest_sigma_rad = 3.0;       ///< of a joint from rest pose, where no marker tells
  double at_rest_sigma_rad = 0.02;   ///< the same of a joint that is held at rest
  double upright_sigma_rad = 0.035;  ///< tilt of a root that is held upright
  double limit_sigma_rad = 0.2;      ///< of a joint beyond its range
};

}  // namespace mocap::bodyfit
