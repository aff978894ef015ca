#pragma once

#include <cmath>
#include <string>

#include "export/clip/clip.h"

namespace mocap::exports::testing {

/// Where marker `m` of subject `s` is in frame `f`, m: a smooth path of its own.
inline Eigen::Vector3d path_m(std::size_t s, std::size_t m, double f) {
  const auto subject = static_cast<double>(s), marker = static_cast<double>(m);
  return {1.5 * std::sin(0.01 * f + marker) + subject, 2.5 * std::cos(0.013 * f) - 0.1 * marker,
          1.0 + 0.5 * std::sin(0.02 * f + subject)};
}

/// Whether marker `m` has no position in frame `f`: marker 1 has a gap from frame 10 to 14.
inline bool lost(std::size_t m, std::size_t f) { return m == 1 && f >= 10 && f <= 14; }

/// Whether marker `m` is filled in frame `f`.
inline bool filled(std::size_t m, std::size_t f) { return m == 0 && f % 7 == 3; }

/// A subject with markers on the paths and two bones, the second one 0.25 m above the first.
inline ClipSubject sample_subject(const std::string& name, std::size_t s, std::size_t markers, std::size_t frames) {
  ClipSubject subject;
  subject.subject.name = name;
  MarkerSet& set = subject.subject.marker_set;
  set.name = name + "-set";
  set.skeleton.name = "two";
  set.skeleton.bones.resize(2);
  set.skeleton.bones[0].name = "Hips";
  set.skeleton.bones[0].aliases = {"Hips", "pelvis", "hips"};
  set.skeleton.bones[1].name = "Chest";
  set.skeleton.bones[1].parent = 0;
  set.skeleton.bones[1].aliases = {"Spine", "spine_01", "spine"};
  for (std::size_t m = 0; m < markers; ++m) {
    set.markers.push_back({"M" + std::to_string(m), static_cast<int>(m % 2), Eigen::Vector3d::Zero(), {}});
  }
  for (std::size_t f = 0; f < frames; ++f) {
    for (std::size_t m = 0; m < markers; ++m) {
      MarkerSample sample;
      if (!lost(m, f)) {
        sample.position_m = path_m(s, m, static_cast<double>(f));
        sample.state = filled(m, f) ? LabelState::Filled : LabelState::Measured;
        sample.residual_m = 0.002F;
        sample.cameras = 3;
      }
      subject.markers.push_back(sample);
    }
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.01 * static_cast<double>(f), Eigen::Vector3d::UnitZ()));
    subject.bones.push_back({{path_m(s, 0, static_cast<double>(f)), turn}, BoneState::Measured});
    subject.bones.push_back({{{0.0, 0.0, 0.25}, Eigen::Quaterniond::Identity()}, BoneState::Measured});
  }
  return subject;
}

/// Two persons and a prop with 4, 3 and 2 markers at 29.97 Hz, one event and a timecode.
inline Clip sample_clip(std::size_t frames = 40) {
  Clip clip;
  clip.name = "walk 1";
  clip.producer = "mocapd test";
  clip.rate = {30000, 1001};
  clip.frames = frames;
  clip.first_frame = 100;
  clip.first_timecode = Timecode{1, 2, 59, 28, 30, true};
  clip.subjects = {sample_subject("anna", 0, 4, frames), sample_subject("bob", 1, 3, frames),
                   sample_subject("prop", 2, 2, frames)};
  clip.events = {{0.5, "Clap"}};
  return clip;
}

}  // namespace mocap::exports::testing
