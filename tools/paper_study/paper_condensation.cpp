#include "paper_study/paper_condensation.h"

#include <algorithm>
#include <cmath>

namespace mocap::paper_study {
namespace {

constexpr double kStepPerSize = 1.0 / 1.5 / 5.0;

}  // namespace

PaperCondensation::PaperCondensation(const Settings& settings, const filter::Seen<2>& first)
    : image_(settings.image), random_(settings.seed), seen_(first.point), predicted_(first.point) {
  for (filter::Vector<2>& particle : particles_) {
    particle.x() = std::floor(image_.width_px * random_.unit());
    particle.y() = std::floor(image_.height_px * random_.unit());
  }
}

void PaperCondensation::predict(double) {
  weigh();
  double total = 0.0;
  filter::Vector<2> sum = filter::Vector<2>::Zero();
  for (std::size_t i = 0; i < kParticles; ++i) {
    total += weights_[i];
    sum += weights_[i] * particles_[i];
  }
  if (!(total > 0.0)) return;  // all weights underflow: keep the state
  predicted_ = image_.clamped(sum / total);
  select_and_diffuse(total);
}

void PaperCondensation::weigh() {
  filter::Vector<2> mean = filter::Vector<2>::Zero();
  for (const filter::Vector<2>& particle : particles_) mean += particle / kParticles;
  Eigen::Array2d variance = Eigen::Array2d::Zero();
  for (const filter::Vector<2>& particle : particles_) variance += (particle - mean).array().square() / kParticles;
  radius_px_ = 0.5 * variance.sqrt().sum();
  for (std::size_t i = 0; i < kParticles; ++i) {
    weights_[i] = std::exp(-0.5 * ((seen_ - particles_[i]).array().square() / variance).sum());
  }
}

// Systematic resampling: particle i of the new set is the first particle of the old set whose cumulative weight exceeds
// i / kParticles of the total.
void PaperCondensation::select_and_diffuse(double total) {
  const std::array<filter::Vector<2>, kParticles> old = particles_;
  double sum = weights_[0];
  std::size_t source = 0;
  for (std::size_t i = 0; i < kParticles; ++i) {
    const double wanted = total * static_cast<double>(i) / kParticles;
    while (sum <= wanted && source + 1 < kParticles) sum += weights_[++source];
    const double x = (2.0 * random_.unit() - 1.0) * kStepPerSize * image_.width_px;
    const double y = (2.0 * random_.unit() - 1.0) * kStepPerSize * image_.height_px;
    particles_[i] = old[source] + filter::Vector<2>(x, y);
  }
}

}  // namespace mocap::paper_study
