#pragma once

#include "filter/point_filter.h"

namespace mocap::paper_study {

/// The size of the images of a filter. Predictions are clamped to 0 to the size.
struct PaperImage {
  double width_px = 640.0;
  double height_px = 480.0;

  filter::Vector<2> clamped(const filter::Vector<2>& point) const;
};

/// The Alpha-Beta filter of the study, including its weaknesses. Units are px and frames: every step is one frame,
/// independent of the elapsed time.
///
///   x' = x + v;   r = z - x';   x = x' + 1.0 r;   v = v + 0.8 r     (equations 1 to 3)
/// The gate is a circle with a radius of 5 % of the image diagonal. A hidden point continues with its velocity up to
/// the border of the image.
///
/// Source: Queiroz, Gomide, de Albuquerque Araujo, "Evaluation of real time tracking methods for an open source motion
/// capture system", section III.A.
class PaperAlphaBeta {
 public:
  PaperAlphaBeta(const PaperImage& image, const filter::Seen<2>& first) : image_(image), point_(first.point) {}

  void predict(double dt_s);
  filter::Gate<2> gate() const { return {point_, filter::Matrix<2>::Identity() * radius_px() * radius_px()}; }
  double radius_px() const;
  void update(const filter::Seen<2>& seen);
  void coast() {}
  filter::Belief<2> belief() const { return {point_, velocity_, gate().predicted_covariance}; }

 private:
  PaperImage image_;
  filter::Vector<2> point_;
  filter::Vector<2> velocity_ = filter::Vector<2>::Zero();  // px per frame
};

}  // namespace mocap::paper_study
