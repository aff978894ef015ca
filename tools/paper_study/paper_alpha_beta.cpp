#include "paper_study/paper_alpha_beta.h"

#include <algorithm>
#include <cmath>

namespace mocap::paper_study {
namespace {

constexpr double kAlpha = 1.0;
constexpr double kBeta = 0.8;
constexpr double kGatePerDiagonal = 0.05;

}  // namespace

filter::Vector<2> PaperImage::clamped(const filter::Vector<2>& point) const {
  return {std::clamp(point.x(), 0.0, width_px), std::clamp(point.y(), 0.0, height_px)};
}

void PaperAlphaBeta::predict(double) { point_ = image_.clamped(point_ + velocity_); }

double PaperAlphaBeta::radius_px() const { return kGatePerDiagonal * std::hypot(image_.width_px, image_.height_px); }

void PaperAlphaBeta::update(const filter::Seen<2>& seen) {
  const filter::Vector<2> residual = seen.point - point_;
  point_ += kAlpha * residual;
  velocity_ += kBeta * residual;
}

}  // namespace mocap::paper_study
