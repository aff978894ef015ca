#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mocap::paper_study {

/// What a clip shows: the five situations of the study, then harder ones of ours.
enum class Situation {
  Slow,
  Rapid,
  Accelerated,
  Occlusion,
  Swapping,
  PassersBy,           ///< a slow zigzag while others wander by
  TwoBehindOne,        ///< two ways behind one barrier at the same time
  RandomAcceleration,  ///< each frame another acceleration
};

inline constexpr std::array kStudied{Situation::Slow, Situation::Rapid, Situation::Accelerated, Situation::Occlusion,
                                     Situation::Swapping};
inline constexpr std::array kHarder{Situation::PassersBy, Situation::TwoBehindOne, Situation::RandomAcceleration};

/// As it stands in reports: "slow", "passers_by".
const char* name_of(Situation situation);

/// How the study counts a loss.
enum class LossRule {
  AnyMiss,    ///< the label stood without its marker in any frame
  LastFrame,  ///< the label is more than 15 px off its marker in the last frame
};
LossRule loss_rule_of(Situation situation);

inline constexpr int kWidth_px = 640;
inline constexpr int kHeight_px = 480;
inline constexpr double kFrameRate_Hz = 30.0;
inline constexpr double kDiscRadius_px = 7.0;

/// A dark rectangle that hides what passes behind it.
struct Barrier {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();  ///< unit, in the direction of the way
  double half_length_px = 0.0;                       ///< along
  double half_height_px = 0.0;                       ///< across

  bool covers(const Eigen::Vector2d& point_px) const;
  /// From the point to the rectangle; 0 inside.
  double distance_px(const Eigen::Vector2d& point_px) const;
};

/// Where each marker is in each frame. The first marker bears the label, from the first frame on.
struct Clip {
  Situation situation = Situation::Slow;
  std::vector<std::vector<Eigen::Vector2d>> ways_px;  ///< by marker, then by frame
  std::vector<Barrier> barriers;
  bool turned_back = false;  ///< swapping: the markers went back instead of on

  std::size_t frames() const { return ways_px.front().size(); }
};

/// Draws a clip by the law of its situation; the same seed gives the same clip. The laws of the study's situations are
/// those on which the original trackers give about the published figures.
Clip make_clip(Situation situation, std::uint64_t seed);

/// The seed of one clip of a run; every situation, clip and base has its own.
std::uint64_t clip_seed(std::uint64_t seed_base, Situation situation, std::size_t clip);

}  // namespace mocap::paper_study
