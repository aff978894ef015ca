#pragma once

#include "model/description.h"

namespace mocap::wire::testing {

/// A description with two cameras and one subject of two bones and two markers.
inline Description sample_description(std::uint32_t version = 1) {
  Description d;
  d.version = version;
  d.producer = "mocapd test";
  d.session_id = "session";
  d.nominal_rate_hz = 120.0;
  CameraModel camera;
  camera.name = "north";
  camera.width_px = 1280;
  camera.height_px = 1024;
  camera.lens.fx_px = 1000.25;
  camera.lens.fy_px = 1001.5;
  camera.lens.cx_px = 639.5;
  camera.lens.cy_px = 511.5;
  camera.lens.distortion << -0.1, 0.02, 0.001, -0.002, 0.0003;
  camera.camera_from_world.rotation =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, -0.5).normalized()).toRotationMatrix();
  camera.camera_from_world.translation = {0.1, -0.2, 4.0};
  d.cameras.push_back(camera);
  camera.name = "south";
  camera.lens.kind = LensKind::Fisheye;
  d.cameras.push_back(camera);
  Subject subject;
  subject.name = "actor";
  subject.marker_set.name = "pair";
  subject.marker_set.skeleton.name = "two";
  Bone hips;
  hips.name = "Hips";
  hips.rest_offset_m = {0.0, 0.0, 0.95};
  hips.rotation_limits = {AngleRange{}, AngleRange{-1.0, 2.0}, std::nullopt};
  hips.aliases = {"Hips", "pelvis", "hips"};
  Bone chest;
  chest.name = "Chest";
  chest.parent = 0;
  chest.rest_offset_m = {0.0, 0.0, 0.25};
  subject.marker_set.skeleton.bones = {hips, chest};
  subject.marker_set.markers = {{"HipsMarker", 0, {0.1, 0.0, 0.0}, {1.0F, 0.5F, 0.25F}},
                                {"ChestMarker", 1, {0.0, 0.2, 0.0}, {0.0F, 0.5F, 0.25F}}};
  d.subjects.push_back(subject);
  return d;
}

}  // namespace mocap::wire::testing
