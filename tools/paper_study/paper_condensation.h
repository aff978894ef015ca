#pragma once

#include <array>
#include <cstdint>

#include "filter/random.h"
#include "paper_study/paper_alpha_beta.h"

namespace mocap::paper_study {

/// The CONDENSATION filter of the study, including its weaknesses. Units are px and frames: every step is one frame,
/// independent of the elapsed time. 100 particles with positions only, initially over the whole image. A step weights
/// the particles by their distance to the last measurement relative to their own spread, predicts the weighted mean,
/// resamples, and adds a uniform step of up to width / 7.5 and height / 7.5 (a fifth of the bounds width / 1.5 and
/// height / 1.5). The prediction is therefore about the last measured position. The gate is a circle with half of the
/// summed standard deviations of x and y before the step as radius. A hidden point stays where it is. Resampling starts
/// with the first particle whatever its weight, so that this particle drifts away and the gate grows slowly: from 66 px
/// after ten frames to twice that after 800.
///
/// Source: as PaperAlphaBeta, section III.C; the step: Isard and Blake, "CONDENSATION" (1998), figure 5.
class PaperCondensation {
 public:
  struct Settings {
    PaperImage image;
    std::uint64_t seed = 1;
  };

  PaperCondensation(const Settings& settings, const filter::Seen<2>& first);

  void predict(double dt_s);
  filter::Gate<2> gate() const { return {predicted_, filter::Matrix<2>::Identity() * radius_px_ * radius_px_}; }
  double radius_px() const { return radius_px_; }
  void update(const filter::Seen<2>& seen) { seen_ = seen.point; }
  void coast() {}
  filter::Belief<2> belief() const { return {seen_, filter::Vector<2>::Zero(), gate().predicted_covariance}; }

 private:
  static constexpr std::size_t kParticles = 100;

  void weigh();
  void select_and_diffuse(double total);

  PaperImage image_;
  filter::Random random_;
  std::array<filter::Vector<2>, kParticles> particles_;
  std::array<double, kParticles> weights_{};
  filter::Vector<2> seen_;
  filter::Vector<2> predicted_;
  double radius_px_ = 0.0;
};

}  // namespace mocap::paper_study
