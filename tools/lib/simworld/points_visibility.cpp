#include "lib/simworld/points_visibility.h"

#include <algorithm>
#include <cmath>

namespace mocap::simworld {
namespace {

constexpr double kSeenShare = 0.63;
// Median and 90th percentile of how long a camera does not see a marker give a log-normal distribution (what is hidden
// between two sets goes unnoticed, so that its median is under the measured one); nothing stays
// hidden for longer than the end of an exercise.
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
