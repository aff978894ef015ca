#include "pose/depth_gaussian_sum.h"

#include <algorithm>
#include <cmath>

namespace mocap::pose {
namespace {

// A ray that turned by more is that of another camera; and after such a gap speed tells nothing.
constexpr double kSameRay = 0.9;
constexpr double kGap_s = 0.1;
// Of the depth that it begins with, and its speed.
constexpr double kBegin_m = 0.01;
constexpr double kBegin_m_s = 1.0;
// How speed strays: a hand's by 0.1 m/s from set to set at 120 Hz.
constexpr double kStray_m2_s3 = 1.0;
// Depths are told apart no finer; and are weighed at so many places within so many sigmas.
constexpr double kFinest_m = 3e-4;
constexpr int kPlaces = 33;
constexpr double kWithin = 3.0;
// A sight as unlikely as that shows that the speed jumped.
constexpr double kNowhere = 1e-8;
// Nothing is ruled out for good.
constexpr double kLeastShare = 1e-6;
constexpr double kMostCost = 10.0;

double squared(double x) { return x * x; }

}  // namespace

bool RayDepth::follows(const Eigen::Vector3d& direction, Timestamp at) const {
  return direction_.dot(direction) > kSameRay && to_s(at - learnt_at_) < kGap_s && at >= learnt_at_;
}

void RayDepth::begin(Timestamp at, const Eigen::Vector3d& direction, double depth_m) {
  direction_ = direction;
  learnt_at_ = weighed_at_ = at;
  learnt_.fill({});
  learnt_[slot_of(depth_m < 0.0 ? Before : Behind, 0.0)] = begun_at(depth_m, 1.0);
  weighed_ = learnt_;
}

RayDepth::Part RayDepth::begun_at(double depth_m, double share) {
  return {{depth_m, 0.0}, Eigen::Vector2d(squared(kBegin_m), squared(kBegin_m_s)).asDiagonal(), share};
}

std::size_t RayDepth::slot_of(Side side, double speed_m_s) {
  return 2 * static_cast<std::size_t>(side) + (speed_m_s < 0.0 ? 0 : 1);
}

RayDepth::Part RayDepth::led_on(const Part& part, double step_s) {
  Eigen::Matrix2d on, strayed;
  on << 1.0, step_s, 0.0, 1.0;
  strayed << squared(step_s) / 3.0, step_s / 2.0, step_s / 2.0, 1.0;
  return {on * part.state, on * part.covariance * on.transpose() + kStray_m2_s3 * step_s * strayed, part.share};
}

// By side, with shares: what is left of a part of whose depth the square was seen. Summed up over depths, as near 0 the
// square is no line; the speed follows the depth.
std::array<RayDepth::Part, 2> RayDepth::met(const Part& part, double half2_m2, double sigma_m2) {
  const double sigma_m = std::sqrt(part.covariance(0, 0));
  const double step_m = 2.0 * kWithin * sigma_m / (kPlaces - 1);
  std::array<Eigen::Vector3d, 2> moments{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (int i = 0; i < kPlaces; ++i) {
    const double off_m = i * step_m - kWithin * sigma_m;
    const double depth_m = part.state.x() + off_m;
    const double off_m2 = half2_m2 - squared(depth_m);
    const double weight = std::exp(-0.5 * (squared(off_m / sigma_m) + squared(off_m2 / sigma_m2)));
    moments[depth_m < 0.0 ? Before : Behind] += weight * Eigen::Vector3d(1.0, off_m, squared(off_m));
  }
  const Eigen::Vector2d gain = part.covariance.col(0) / part.covariance(0, 0);
  std::array<Part, 2> found;
  for (const Side side : {Before, Behind}) {
    const double weight = moments[side][0];
    if (!(weight > 0.0)) continue;
    const double off_m = moments[side][1] / weight;
    const double variance_m2 = std::max(squared(0.1 * kFinest_m), moments[side][2] / weight - squared(off_m));
    found[side] = {part.state + gain * off_m,
                   part.covariance + (variance_m2 - part.covariance(0, 0)) * gain * gain.transpose(),
                   part.share * weight / kPlaces};
  }
  return found;
}

// Both as one, with the same mean and covariance.
void RayDepth::add(const Part& part, Part& to) {
  const double share = to.share + part.share;
  if (!(share > 0.0)) return;
  const double by = part.share / share;
  const Eigen::Vector2d apart = part.state - to.state;
  to.covariance =
      ((1.0 - by) * to.covariance + by * part.covariance + by * (1.0 - by) * apart * apart.transpose()).eval();
  to.state += by * apart;
  to.share = share;
}

void RayDepth::weigh(Timestamp at, const Eigen::Vector3d& direction, double half2_m2, double sigma_m2) {
  weighed_at_ = at;
  direction_ = direction;
  const double finest_m2 = std::max(sigma_m2, 2.0 * kFinest_m * std::sqrt(std::max(0.0, half2_m2)));
  weighed_.fill({});
  for (const Part& part : learnt_) {
    if (!(part.share > 0.0)) continue;
    const std::array<Part, 2> found = met(led_on(part, to_s(at - learnt_at_)), half2_m2, finest_m2);
    for (const Side side : {Before, Behind}) add(found[side], weighed_[slot_of(side, found[side].state.y())]);
  }
  double whole = 0.0;
  for (const Part& part : weighed_) whole += part.share;
  if (whole < kNowhere) {
    begin_anew(std::sqrt(std::max(0.0, half2_m2)));
    return;
  }
  for (Part& part : weighed_) {
    if (part.share > 0.0) part.share = std::max(kLeastShare, part.share / whole);
  }
}

// It is on the side where it was, and its speed is not known any more.
void RayDepth::begin_anew(double half_m) {
  const std::array<double, 2> shares{share_of(Before, learnt_), share_of(Behind, learnt_)};
  weighed_.fill({});
  for (const Side side : {Before, Behind}) {
    if (shares[side] > 0.0) weighed_[slot_of(side, 0.0)] = begun_at(side == Before ? -half_m : half_m, shares[side]);
  }
}

double RayDepth::share_of(Side side, const Parts& parts) {
  return parts[slot_of(side, -1.0)].share + parts[slot_of(side, 1.0)].share;
}

double RayDepth::cost(Side side) const {
  const double share = share_of(side, weighed_);
  return std::clamp(-std::log(share), 0.0, kMostCost);
}

void RayDepth::learn(Timestamp at) {
  if (weighed_at_ != at) return;
  learnt_ = weighed_;
  learnt_at_ = at;
}

}  // namespace mocap::pose
