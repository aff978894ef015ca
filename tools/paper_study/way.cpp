#include "paper_study/way.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mocap::paper_study {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kTurnJitter_deg = 15.0;
constexpr double kMostTurn_deg =
    160.0;  // largest change to a new random direction, so that consecutive legs do not overlap
constexpr double kSlowEnd_px = 0.5;  // speed per frame at the end of an accelerated leg

double draw_angle(scene::Random& random) { return draw(random, 0.0, 2.0 * std::numbers::pi); }
double draw_side(scene::Random& random) { return happens(random, 0.5) ? 1.0 : -1.0; }

/// Distance to the margin of the image in a direction.
double free_way(const Eigen::Vector2d& from_px, double angle_rad) {
  const Eigen::Vector2d heading = heading_of(angle_rad);
  const Eigen::Vector2d far(kWidth_px - 1 - kMargin_px, kHeight_px - 1 - kMargin_px);
  double way = std::numeric_limits<double>::infinity();
  for (const int axis : {0, 1}) {
    const double room = heading[axis] > 0.0 ? far[axis] - from_px[axis] : from_px[axis] - kMargin_px;
    if (std::abs(heading[axis]) > 1e-12) way = std::min(way, std::max(0.0, room) / std::abs(heading[axis]));
  }
  return way;
}

/// A random direction with at least `room_px` to the margin.
double draw_free_angle(scene::Random& random, const Eigen::Vector2d& from_px, double room_px) {
  double angle_rad = draw_angle(random);
  while (free_way(from_px, angle_rad) < room_px) angle_rad = draw_angle(random);
  return angle_rad;
}

/// The heading after a turn. If the leg would leave the image, turns to the other side, or by a larger angle.
double turned(double angle_rad, double turn_rad, const Eigen::Vector2d& point_px, double leg_px) {
  for (int tries = 0; tries < 36; ++tries) {
    const double more_rad = 5.0 * kDegree * tries;
    for (const double side : {1.0, -1.0}) {
      const double end_rad = angle_rad + side * (turn_rad + std::copysign(more_rad, turn_rad));
      if (free_way(point_px, end_rad) >= leg_px) return end_rad;
    }
  }
  return angle_rad + std::numbers::pi;
}

/// The first of up to 51 drawn directions with at least `room_px` to the margin, or else the direction with the largest
/// distance.
template <class Draw>
double widest(const Eigen::Vector2d& from_px, double room_px, Draw draw_direction) {
  double best_rad = draw_direction();
  double best_px = free_way(from_px, best_rad);
  for (int tries = 0; tries < 50 && best_px < room_px; ++tries) {
    const double angle_rad = draw_direction();
    const double room = free_way(from_px, angle_rad);
    if (room > best_px) {
      best_px = room;
      best_rad = angle_rad;
    }
  }
  return best_rad;
}

}  // namespace

double draw(scene::Random& random, double low, double high) { return low + (high - low) * random.uniform(); }
bool happens(scene::Random& random, double probability) { return random.uniform() < probability; }
Eigen::Vector2d heading_of(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }

bool inside_margin(const Eigen::Vector2d& point_px) {
  return point_px.x() >= kMargin_px && point_px.x() <= kWidth_px - 1 - kMargin_px && point_px.y() >= kMargin_px &&
         point_px.y() <= kHeight_px - 1 - kMargin_px;
}

Eigen::Vector2d draw_point(scene::Random& random) {
  const double x = draw(random, kMargin_px, kWidth_px - 1 - kMargin_px);
  return {x, draw(random, kMargin_px, kHeight_px - 1 - kMargin_px)};
}

Eigen::Vector2d Arc::at(double along_px) const {
  if (std::abs(curvature_1_px) < 1e-9) return through_px + along_px * heading_of(angle_rad);
  const double end_rad = angle_rad + curvature_1_px * along_px;
  return through_px +
         Eigen::Vector2d(std::sin(end_rad) - std::sin(angle_rad), std::cos(angle_rad) - std::cos(end_rad)) /
             curvature_1_px;
}

Points zigzag(const ZigzagLaw& law, scene::Random& random) {
  const double speed_px = draw(random, law.min_speed_px, law.max_speed_px);
  const double mean_leg_px = draw(random, law.min_leg_px, law.max_leg_px);
  const double mean_turn_deg = draw(random, law.min_turn_deg, law.max_turn_deg);
  const auto draw_leg = [&] { return mean_leg_px * draw(random, 0.7, 1.3); };
  Points way{draw_point(random)};
  Eigen::Vector2d point_px = way.front();
  double leg_px = draw_leg();  // remaining length of the leg
  double angle_rad = draw_free_angle(random, point_px, leg_px);
  double side = draw_side(random);
  double left_px = speed_px;  // remaining motion in this frame
  while (way.size() < law.frames) {
    const double step_px = std::min(left_px, leg_px);
    point_px += step_px * heading_of(angle_rad);
    left_px -= step_px;
    leg_px -= step_px;
    if (left_px <= 0.0) {
      way.push_back(point_px);
      left_px = speed_px;
    }
    if (leg_px > 0.0) continue;
    leg_px = draw_leg();
    side = -side;
    const double turn_deg = side * (mean_turn_deg + draw(random, -kTurnJitter_deg, kTurnJitter_deg));
    const double anew_deg = draw(random, -kMostTurn_deg, kMostTurn_deg);
    angle_rad = turned(angle_rad, (happens(random, law.anew) ? anew_deg : turn_deg) * kDegree, point_px, leg_px);
  }
  return way;
}

Points accelerated_zigzag(std::size_t frames, scene::Random& random) {
  Points way{draw_point(random)};
  double angle_rad = 0.0, speed_px = 0.0, peak_px = draw(random, 14.0, 34.0), acceleration_px = draw(random, 1.0, 3.5);
  bool rising = false;
  const auto turn = [&] { return angle_rad + draw_side(random) * draw(random, 60.0, 180.0) * kDegree; };
  while (way.size() < frames) {
    if (!rising && speed_px <= kSlowEnd_px) {
      speed_px = kSlowEnd_px;
      rising = true;
      angle_rad = widest(way.back(), peak_px * peak_px / acceleration_px, [&] { return draw_angle(random); });
    }
    const bool at_margin = free_way(way.back(), angle_rad) < speed_px;
    if (at_margin || (rising && speed_px >= peak_px)) {
      if (at_margin || happens(random, 0.2))
        angle_rad = widest(way.back(), 0.5 * speed_px * speed_px / acceleration_px, turn);
      rising = false;
    }
    way.push_back(way.back() + std::min(speed_px, free_way(way.back(), angle_rad)) * heading_of(angle_rad));
    speed_px =
        rising ? std::min(peak_px, speed_px + acceleration_px) : std::max(kSlowEnd_px, speed_px - acceleration_px);
  }
  return way;
}

Points random_acceleration(std::size_t frames, scene::Random& random) {
  constexpr double kMaxSpeed_px = 30.0;
  const double sigma_px = draw(random, 1.5, 5.0);
  Points way{draw_point(random)};
  Eigen::Vector2d velocity_px = draw(random, 0.0, 15.0) * heading_of(draw_angle(random));
  while (way.size() < frames) {
    velocity_px += sigma_px * Eigen::Vector2d(random.normal(), random.normal());
    if (velocity_px.norm() > kMaxSpeed_px) velocity_px *= kMaxSpeed_px / velocity_px.norm();
    const Eigen::Vector2d next_px = way.back() + velocity_px;
    // Reflects the velocity at the margin.
    for (const int axis : {0, 1}) {
      const double far_px = (axis == 0 ? kWidth_px : kHeight_px) - 1 - kMargin_px;
      if (next_px[axis] < kMargin_px || next_px[axis] > far_px) velocity_px[axis] = -velocity_px[axis];
    }
    way.push_back(way.back() + velocity_px);
  }
  return way;
}

}  // namespace mocap::paper_study
