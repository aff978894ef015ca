#pragma once

namespace mocap::geometry {

/// A point nearer to the plane of a camera than this is not in front of the camera. Avoids a division by about zero.
inline constexpr double kMinDepth_m = 0.01;

/// Smallest eigenvalue of the information matrix of an observable point, 1/m^2: a standard deviation of 1 m.
inline constexpr double kMinInformation_1_m2 = 1.0;

}  // namespace mocap::geometry
