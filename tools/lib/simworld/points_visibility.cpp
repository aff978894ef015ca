#include "lib/simworld/points_visibility.h"

#include <algorithm>
#include <cmath>

namespace mocap::simworld {
namespace {

constexpr double kSeenShare = 0.63;
// The time for which a marker is hidden from a camera is log-normal, fitted to the measured median and 90th percentile
// (see points_visibility.h). The median is smaller than the measured 0.04 s because occlusions between two samples are
// not measured. The maximum bounds the tail of the distribution.
constexpr double kMedianHidden_s = 0.025;
constexpr double kSpreadHidden = 2.7;  // ln(0.8 / 0.025) / 1.2816
constexpr double kMostHidden_s = 3.0;

}  // namespace

VisibilityModel::VisibilityModel(Visibility kind, std::size_t cameras, std::size_t lights, std::uint64_t seed)
    : kind_(kind), lights_(lights), random_(seed), states_(cameras * lights) {
  if (kind_ == Visibility::Perfect) return;
  constexpr int kDraws = 20000;
  scene::Random sample(1);
  std::swap(sample, random_);
  double sum_s = 0.0;
  for (int i = 0; i < kDraws; ++i) sum_s += hidden_s();
  std::swap(sample, random_);
  mean_visible_s_ = sum_s / kDraws * kSeenShare / (1.0 - kSeenShare);
  for (State& state : states_) {
    state.visible = random_.uniform() < kSeenShare;
    state.left_s = random_.uniform() * (state.visible ? visible_s() : hidden_s());
  }
}

double VisibilityModel::hidden_s() {
  return std::min(kMostHidden_s, kMedianHidden_s * std::exp(kSpreadHidden * random_.normal()));
}

double VisibilityModel::visible_s() { return -mean_visible_s_ * std::log(1.0 - random_.uniform()); }

void VisibilityModel::advance(double dt_s) {
  if (kind_ == Visibility::Perfect) return;
  for (State& state : states_) {
    state.left_s -= dt_s;
    while (state.left_s <= 0.0) {
      state.visible = !state.visible;
      state.left_s += state.visible ? visible_s() : hidden_s();
    }
  }
}

bool VisibilityModel::sees(std::size_t camera, std::size_t light) const {
  return states_[camera * lights_ + light].visible;
}

}  // namespace mocap::simworld
