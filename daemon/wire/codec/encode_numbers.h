#pragma once

#include <algorithm>
#include <cstdint>

#include "mocap/v1/snapshot.pb.h"
#include "model/clock/timecode.h"
#include "model/subject_state.h"

namespace mocap::wire {

// Conversions of model values to wire values, shared by `encode` and SnapshotEncoder.

inline v1::SubjectPhase code_of(SubjectPhase phase) {
  switch (phase) {
    case SubjectPhase::Searching: return v1::SUBJECT_PHASE_SEARCHING;
    case SubjectPhase::Tracking: return v1::SUBJECT_PHASE_TRACKING;
    case SubjectPhase::Lost: return v1::SUBJECT_PHASE_LOST;
  }
  return v1::SUBJECT_PHASE_UNSPECIFIED;
}

inline v1::MarkerState code_of(LabelState state) {
  switch (state) {
    case LabelState::Lost: return v1::MARKER_STATE_LOST;
    case LabelState::Measured: return v1::MARKER_STATE_MEASURED;
    case LabelState::Filled: return v1::MARKER_STATE_FILLED;
  }
  return v1::MARKER_STATE_UNSPECIFIED;
}

inline v1::BoneState code_of(BoneState state) {
  switch (state) {
    case BoneState::Lost: return v1::BONE_STATE_LOST;
    case BoneState::Measured: return v1::BONE_STATE_MEASURED;
    case BoneState::Filled: return v1::BONE_STATE_FILLED;
  }
  return v1::BONE_STATE_UNSPECIFIED;
}

/// Rounds a fraction to whole percents, 0 to 100.
inline std::uint32_t percent(float fraction) {
  // NOLINTNEXTLINE(bugprone-incorrect-roundings): the value is never negative, and lround would be a library call
  return static_cast<std::uint32_t>(100.0F * std::clamp(fraction, 0.0F, 1.0F) + 0.5F);
}

/// Rounds a residual to whole thousandths of a pixel and clamps it to 0 to 1e6 px.
inline std::uint32_t millipx(double residual_px) {
  // NOLINTNEXTLINE(bugprone-incorrect-roundings): as above
  return static_cast<std::uint32_t>(1000.0 * std::clamp(residual_px, 0.0, 1e6) + 0.5);
}

inline void encode(const Timecode& from, v1::Timecode& into) {
  into.set_hours(from.hours);
  into.set_minutes(from.minutes);
  into.set_seconds(from.seconds);
  into.set_frames(from.frames);
  into.set_frames_per_second(from.frames_per_second);
  into.set_drop_frame(from.drop_frame);
  into.set_subframe(from.subframe);
  into.set_fractional(from.fractional);
}

/// The numbers as they are; see `is_valid`.
inline Timecode timecode_of(const v1::Timecode& from) {
  return {from.hours(),      from.minutes(),    from.seconds(), from.frames(), from.frames_per_second(),
          from.drop_frame(), from.fractional(), from.subframe()};
}

/// Returns the track number plus one; 0 stands for "no track".
inline std::uint32_t plus_one(TrackId id) { return id.names_something() ? id.value + 1 : 0; }

}  // namespace mocap::wire
