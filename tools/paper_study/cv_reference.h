#pragma once

#include <memory>
#include <span>
#include <vector>

#include "model/blob.h"

namespace mocap::paper_study {

/// The usual way with a library, to compare costs with: one cv::KalmanFilter (4 state variables, 2 measured) for each
/// marker, and each in turn takes the nearest blob within its gate that is left.
class CvReference {
 public:
  explicit CvReference(double gate_px);
  ~CvReference();
  CvReference(CvReference&&) noexcept;

  /// One frame; the first names the blobs. Writes each blob's `track`.
  void track(std::span<Blob> blobs);

 private:
  struct Tracks;
  std::unique_ptr<Tracks> tracks_;
  double gate_px_;
};

}  // namespace mocap::paper_study
