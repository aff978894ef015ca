#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mocap::paper_study {

/// The situation that a clip shows: the five situations of the study, then harder situations of our own.
enum class Situation {
  Slow,
  Rapid,
  Accelerated,
  Occlusion,
  Swapping,
  PassersBy,           ///< a slow zigzag while other markers pass
  TwoBehindOne,        ///< two paths behind one barrier at the same time
  RandomAcceleration,  ///< a new random acceleration in each frame
};

inline constexpr std::array kStudied{Situation::Slow, Situation::Rapid, Situation::Accelerated, Situation::Occlusion,
                                     Situation::Swapping};
inline constexpr std::array kHarder{Situation::PassersBy, Situation::TwoBehindOne, Situation::RandomAcceleration};

/// Name in reports, for example "slow" or "passers_by".
const char* name_of(Situation situation);

/// The study's definition of a lost label.
enum class LossRule {
  AnyMiss,    ///< the label is not on its marker in some frame
  LastFrame,  ///< the label is more than 15 px from its marker in the last frame
};
LossRule loss_rule_of(Situation situation);

inline constexpr int kWidth_px = 640;
inline constexpr int kHeight_px = 480;
inline constexpr double kFrameRate_Hz = 30.0;
inline constexpr double kDiscRadius_px = 7.0;

/// A dark rectangle that hides markers behind it.
struct Barrier {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();  ///< unit vector in the direction of the path
  double half_length_px = 0.0;                       ///< in the direction of `along`
  double half_height_px = 0.0;                       ///< perpendicular to `along`

  bool covers(const Eigen::Vector2d& point_px) const;
  /// Distance from the point to the rectangle; 0 inside.
  double distance_px(const Eigen::Vector2d& point_px) const;
};

/// The position of each marker in each frame. The first marker has the label from the first frame on.
struct Clip {
  Situation situation = Situation::Slow;
  std::vector<std::vector<Eigen::Vector2d>> ways_px;  ///< paths, by marker, then by frame
  std::vector<Barrier> barriers;
  bool turned_back = false;  ///< swapping: the markers reversed instead of crossing

  std::size_t frames() const { return ways_px.front().size(); }
};

/// Generates a random clip of a situation. The same seed gives the same clip. The laws of the study's situations were
/// chosen so that the original trackers give about the published figures.
Clip make_clip(Situation situation, std::uint64_t seed);

/// The seed of one clip of a run. It differs for every situation, clip and base.
std::uint64_t clip_seed(std::uint64_t seed_base, Situation situation, std::size_t clip);

}  // namespace mocap::paper_study
