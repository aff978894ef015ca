#pragma once

#include <Eigen/Core>

#include "paper_study/paper_alpha_beta.h"

namespace mocap::paper_study {

/// The Kalman filter of the study, including its weaknesses. Units are px and frames: every step is one frame,
/// independent of the elapsed time.
///
///   state (x, y, vx, vy), constant velocity; R = [0.2845 0.0045; 0.0045 0.0455]; P0 = diag(0, 0, 100, 100)
///   Q = diag(0, 0, q_x, q_y): 0.2 at first, then 0.06 + 0.013 |v| with each axis's velocity     (equations 4 to 8)
/// The predicted point is truncated to whole pixels. The radius of the circular gate is 100 times the mean of the two
/// predicted standard deviations of velocity. A hidden point uses its own prediction as a measurement, so that
/// covariance and gate shrink while the point is hidden.
///
/// Source: as PaperAlphaBeta, section III.B.
class PaperKalman {
 public:
  PaperKalman(const PaperImage& image, const filter::Seen<2>& first);

  void predict(double dt_s);
  filter::Gate<2> gate() const { return {predicted_, filter::Matrix<2>::Identity() * radius_px() * radius_px()}; }
  double radius_px() const;
  void update(const filter::Seen<2>& seen) { correct(seen.point); }
  void coast() { correct(predicted_); }
  filter::Belief<2> belief() const { return {shown_, state_.tail<2>(), covariance_.topLeftCorner<2, 2>()}; }

 private:
  void correct(const filter::Vector<2>& point);

  PaperImage image_;
  Eigen::Vector4d state_;
  Eigen::Matrix4d covariance_;
  Eigen::Vector2d noise_;        // diagonal of Q for the velocities
  filter::Vector<2> predicted_;  // truncated to whole pixels
  filter::Vector<2> shown_;      // position of the label: the last measurement or the prediction
  double velocity_sigma_;        // standard deviation of the last predicted velocity, mean of both axes
};

}  // namespace mocap::paper_study
