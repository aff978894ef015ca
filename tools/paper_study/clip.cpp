#include "paper_study/clip.h"

#include <algorithm>
#include <cmath>

#include "paper_study/way.h"

namespace mocap::paper_study {
namespace {

constexpr ZigzagLaw kSlow{86, 20.0, 25.0, 80.0, 150.0, 40.0, 120.0, 0.2};
constexpr ZigzagLaw kRapid{55, 22.0, 32.0, 50.0, 120.0, 30.0, 110.0, 0.15};
constexpr std::size_t kAcceleratedFrames = 86;
// Law of the unlabelled markers that cross the image.
constexpr ZigzagLaw kStroll{86, 4.0, 12.0, 80.0, 200.0, 20.0, 90.0, 0.2};
constexpr int kStrollers = 4;
constexpr double kClearAtStart_px = 60.0;

Clip passers_by(scene::Random& random) {
  Clip clip;
  clip.ways_px.push_back(zigzag(kSlow, random));
  while (clip.ways_px.size() < 1 + kStrollers) {
    Points way = zigzag(kStroll, random);
    const auto too_near = [&](const Points& other) { return (other.front() - way.front()).norm() < kClearAtStart_px; };
    if (std::ranges::none_of(clip.ways_px, too_near)) clip.ways_px.push_back(std::move(way));
  }
  return clip;
}

Clip alone(Points way) {
  Clip clip;
  clip.ways_px.push_back(std::move(way));
  return clip;
}

Clip draw_clip(Situation situation, scene::Random& random) {
  switch (situation) {
    case Situation::Slow: return alone(zigzag(kSlow, random));
    case Situation::Rapid: return alone(zigzag(kRapid, random));
    case Situation::Accelerated: return alone(accelerated_zigzag(kAcceleratedFrames, random));
    case Situation::Occlusion: return occlusion(random);
    case Situation::Swapping: return swapping(random);
    case Situation::PassersBy: return passers_by(random);
    case Situation::TwoBehindOne: return two_behind_one(random);
    case Situation::RandomAcceleration: break;
  }
  return alone(random_acceleration(kAcceleratedFrames, random));
}

}  // namespace

const char* name_of(Situation situation) {
  switch (situation) {
    case Situation::Slow: return "slow";
    case Situation::Rapid: return "rapid";
    case Situation::Accelerated: return "accelerated";
    case Situation::Occlusion: return "occlusion";
    case Situation::Swapping: return "swapping";
    case Situation::PassersBy: return "passers_by";
    case Situation::TwoBehindOne: return "two_behind_one";
    case Situation::RandomAcceleration: break;
  }
  return "random_acceleration";
}

LossRule loss_rule_of(Situation situation) {
  switch (situation) {
    case Situation::Occlusion:
    case Situation::Swapping:
    case Situation::PassersBy:  // another marker may cover the labelled marker briefly
    case Situation::TwoBehindOne: return LossRule::LastFrame;
    default: return LossRule::AnyMiss;
  }
}

bool Barrier::covers(const Eigen::Vector2d& point_px) const { return distance_px(point_px) <= 0.0; }

double Barrier::distance_px(const Eigen::Vector2d& point_px) const {
  const Eigen::Vector2d off = point_px - centre_px;
  const double beyond = std::max(0.0, std::abs(off.dot(along)) - half_length_px);
  const double beside = std::max(0.0, std::abs(off.x() * -along.y() + off.y() * along.x()) - half_height_px);
  return std::hypot(beyond, beside);
}

Clip make_clip(Situation situation, std::uint64_t seed) {
  scene::Random random(seed);
  Clip clip = draw_clip(situation, random);
  clip.situation = situation;
  return clip;
}

std::uint64_t clip_seed(std::uint64_t seed_base, Situation situation, std::size_t clip) {
  return scene::mixed(scene::mixed(seed_base) ^ scene::mixed(1000 * static_cast<std::uint64_t>(situation) + clip));
}

}  // namespace mocap::paper_study
