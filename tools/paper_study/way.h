#pragma once

#include <Eigen/Core>
#include <vector>

#include "paper_study/clip.h"
#include "scene/random.h"

namespace mocap::paper_study {

using Points = std::vector<Eigen::Vector2d>;

inline constexpr double kMargin_px = 20.0;  ///< least distance of a marker's centre to the border

double draw(scene::Random& random, double low, double high);
bool happens(scene::Random& random, double probability);
Eigen::Vector2d heading_of(double angle_rad);
bool inside_margin(const Eigen::Vector2d& point_px);
Eigen::Vector2d draw_point(scene::Random& random);

/// A path of constant curvature through a point.
struct Arc {
  Eigen::Vector2d through_px = Eigen::Vector2d::Zero();
  double angle_rad = 0.0;       ///< heading at that point
  double curvature_1_px = 0.0;  ///< 0: straight; positive turns from x towards y

  Eigen::Vector2d at(double along_px) const;
  Eigen::Vector2d heading_at(double along_px) const { return heading_of(angle_rad + curvature_1_px * along_px); }
};

/// The law of a zigzag at constant speed.
struct ZigzagLaw {
  std::size_t frames;
  double min_speed_px, max_speed_px;  ///< speed of a clip, px per frame
  double min_leg_px, max_leg_px;      ///< mean length of the legs of a clip
  double min_turn_deg, max_turn_deg;  ///< mean turn of a clip
  double anew;                        ///< probability that a leg is followed by a new random direction
};

Points zigzag(const ZigzagLaw& law, scene::Random& random);
Points accelerated_zigzag(std::size_t frames, scene::Random& random);
Points random_acceleration(std::size_t frames, scene::Random& random);

Clip occlusion(scene::Random& random);
Clip two_behind_one(scene::Random& random);
Clip swapping(scene::Random& random);

}  // namespace mocap::paper_study
