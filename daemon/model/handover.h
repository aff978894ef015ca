#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "model/camera_bits.h"
#include "model/ids.h"

namespace mocap {

/// The parts of a running configuration that continue in the next one (fusion, decision 0003). Every id of the new
/// configuration has the id before; an id that names nothing begins anew.
struct Handover {
  std::vector<SubjectId> subjects;  ///< by new SubjectId: subjects of equal definition
  std::vector<CameraId> cameras;    ///< by new CameraId: cameras whose 2D tracks continue
  /// 3D tracks, labels and poses continue. False if the cameras moved too far: then only the fitted bodies continue.
  bool poses = true;
  bool matching = false;  ///< rig and settings of association are equal: the estimates of the rig error continue
  bool drift = false;     ///< rig and settings of the drift watch are equal: its estimates continue

  /// The new id of a subject; names nothing if the subject does not continue.
  SubjectId now(SubjectId before) const {
    const auto found = std::ranges::find(subjects, before);
    if (!before.names_something() || found == subjects.end()) return {};
    return {static_cast<std::uint32_t>(found - subjects.begin())};
  }
  /// The same cameras in the new configuration, without those that do not continue.
  CameraBits now(CameraBits before) const {
    CameraBits continuing = 0;
    for (std::uint32_t i = 0; i < cameras.size(); ++i) {
      if ((before & bit_of(cameras[i])) != 0) continuing |= bit_of(CameraId{i});
    }
    return continuing;
  }
  /// The same marker in the new configuration; names nothing if its subject does not continue.
  Label now(Label before) const {
    const SubjectId subject = now(before.subject);
    return subject.names_something() ? Label{subject, before.marker} : Label{};
  }
};

}  // namespace mocap
