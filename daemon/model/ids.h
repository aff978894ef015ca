#pragma once

#include <compare>
#include <cstdint>

namespace mocap {

/// A number that names one thing of one kind; ids of different kinds do not mix. Default: names nothing.
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
/// A 3D track of a marker, named or not; unique within the run.
using TrackId = Id<struct TrackKind>;
/// A subject: its index in the order of the configuration, from 0.
using SubjectId = Id<struct SubjectKind>;

/// The name of a marker: which subject, and which marker of its marker set (index from 0).
struct Label {
  SubjectId subject;
  std::uint32_t marker = 0;

  constexpr bool names_something() const noexcept { return subject.names_something(); }
  constexpr auto operator<=>(const Label&) const noexcept = default;
};

}  // namespace mocap
