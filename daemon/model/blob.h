#pragma once

#include <cstdint>
#include <limits>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/bounds.h"
#include "model/ids.h"
#include "model/points.h"

namespace mocap {

/// A bright spot in one image.
struct Blob {
  PixelPoint centroid;     ///< intensity-weighted
  double sigma_px = 0.1;   ///< standard deviation of the centroid, each axis
  double area_px2 = 0.0;   ///< pixels over the threshold
  double peak = 0.0;       ///< brightest pixel, 0 to 1 of the format's range
  double roundness = 1.0;  ///< 1: a disc, towards 0: a line (ratio of the axes of inertia)
  double axis_rad =
      std::numeric_limits<double>::quiet_NaN();  ///< direction of the major axis, from x towards y; NaN: unknown
  double saturated = 0.0;                        ///< share of saturated pixels, 0 to 1
  bool touches_border = false;
  bool merged = false;  ///< the blob probably shows more than one marker
  BlobTrackId track;    ///< the blob's 2D track, if it is unambiguous
};

using Blobs = BoundedVector<Blob, kMaxBlobs>;

/// The blobs of one image: the only data that leave a camera thread.
struct BlobFrame {
  CameraId camera;
  std::uint64_t number = 0;  ///< the camera's own count of exposures
  Timestamp exposed_at;      ///< middle of the exposure
  Timestamp received_at;     ///< the last byte of the image arrived
  Timestamp detected_at;     ///< detection and 2D tracking ended
  Blobs blobs;
};

}  // namespace mocap
