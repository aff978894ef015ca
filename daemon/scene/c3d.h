#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"

namespace mocap::scene {

/// One point at one instant.
struct C3dSample {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< the file's axes
  bool there = false;                                    ///< false: not seen, and not filled
  double residual_m = 0.0;                               ///< 0 where it was filled or filtered
  std::uint8_t cameras = 0;  ///< bit i: camera i + 1 saw it (7 at most; 0 where the file does not tell)
};

/// The points of a C3D file, all of them: markers, nameless ghosts ("*nnn") and what a model computed.
struct C3d {
  double rate_hz = 0.0;
  std::vector<std::string> labels;
  std::size_t frames = 0;
  std::vector<C3dSample> samples;  ///< frame by frame

  const C3dSample& sample(std::size_t frame, std::size_t point) const { return samples[frame * labels.size() + point]; }
};

/// Reads the bytes of a C3D file: integer and floating-point samples, Intel and DEC byte order. Fails with
/// InvalidArgument when they are no whole C3D file, with Unsupported for MIPS (big-endian) files.
///
/// Source: "The C3D File Format" (c3d.org), header, parameter and 3D data sections.
Result<C3d> parse_c3d(std::span<const std::byte> bytes);

enum class C3dPointKind { Marker, Ghost, ModelOutput };

/// What each point of a file is, by the labels: "*nnn" and empty ones are ghosts; names with Angles, Force, Moment,
/// Power, CentreOfMass, GRF, and the four points PELO PELA PELL PELP of a segment's axes (any stem of which all four
/// are there) are a model's output.
std::vector<C3dPointKind> kinds_of(std::span<const std::string> labels);

}  // namespace mocap::scene
