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
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the file's axes
  bool there = false;                                    ///< false: neither measured nor filled
  double residual_m = 0.0;                               ///< 0 for a filled or filtered sample
  std::uint8_t cameras = 0;  ///< bit i: camera i + 1 measured the point (7 cameras at most); 0: not in the file
};

/// All points of a C3D file: markers, unlabelled points ("*nnn") and outputs of a model.
struct C3d {
  double rate_hz = 0.0;
  std::vector<std::string> labels;
  std::size_t frames = 0;
  std::vector<C3dSample> samples;  ///< frame after frame

  const C3dSample& sample(std::size_t frame, std::size_t point) const { return samples[frame * labels.size() + point]; }
};

/// Reads the bytes of a C3D file: integer and floating-point samples, Intel and DEC byte order. Fails with
/// InvalidArgument if the header, the parameters or the first frame are not valid, and with Unsupported for a MIPS
/// (big-endian) file. Frames that are missing at the end are omitted.
///
/// Source: "The C3D File Format" (c3d.org), header, parameter and 3D data sections.
Result<C3d> parse_c3d(std::span<const std::byte> bytes);

enum class C3dPointKind { Marker, Ghost, ModelOutput };

/// The kind of each point of a file, by its label. "*nnn" and an empty label are ghosts. A label that contains Angle,
/// Force, Moment, Power, CentreOfMass, GRF or Reaction is a model output, as are the four points of a segment's axes
/// (PELO PELA PELL PELP: any stem with all four letters).
std::vector<C3dPointKind> kinds_of(std::span<const std::string> labels);

}  // namespace mocap::scene
