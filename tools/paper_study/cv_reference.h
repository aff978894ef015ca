#pragma once

#include <memory>
#include <span>
#include <vector>

#include "model/blob.h"

namespace mocap::paper_study {

/// Reference for the cost: one cv::KalmanFilter (4 state variables, 2 measurements) for each marker, and greedy
/// assignment of the nearest free blob within the gate.
class CvReference {
 public:
  explicit CvReference(double gate_px);
  ~CvReference();
  CvReference(CvReference&&) noexcept;

  /// Tracks one frame and writes each blob's `track`. The first frame initiates one track for each blob.
  void track(std::span<Blob> blobs);

 private:
  struct Tracks;
  std::unique_ptr<Tracks> tracks_;
  double gate_px_;
};

}  // namespace mocap::paper_study
