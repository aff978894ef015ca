#pragma once

#include <compare>
#include <cstdint>

namespace mocap {

/// An id of one kind of thing; ids of different kinds do not convert. Default: none.
template <class Kind>
struct Id {
  static constexpr std::uint32_t kNothing = 0xFFFF'FFFF;

  std::uint32_t value = kNothing;

  constexpr bool names_something() const noexcept { return value != kNothing; }
  constexpr auto operator<=>(const Id&) const noexcept = default;  // NOLINT(modernize-use-nullptr): misread
};

/// A camera: its index in the order of the configuration, from 0.
using CameraId = Id<struct CameraKind>;
/// One camera's 2D track of a blob; unique within the camera and run.
using BlobTrackId = Id<struct BlobTrackKind>;
/// A 3D track of a marker, labelled or not; unique within the run.
using TrackId = Id<struct TrackKind>;
/// A subject: its index in the order of the configuration, from 0.
using SubjectId = Id<struct SubjectKind>;

/// The label of a marker: its subject, and its index in the subject's marker set (from 0).
struct Label {
  SubjectId subject;
  std::uint32_t marker = 0;

  constexpr bool names_something() const noexcept { return subject.names_something(); }
  constexpr auto operator<=>(const Label&) const noexcept = default;
};

}  // namespace mocap
