// The situations with barriers, and those with crossing paths.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "paper_study/way.h"

namespace mocap::paper_study {
namespace {

constexpr std::size_t kFrames = 86;
constexpr double kLast = static_cast<double>(kFrames - 1);
constexpr std::size_t kClearFrames = 8;  // free frames at the start and at the end
constexpr double kDegree = std::numbers::pi / 180.0;

double draw_curvature(scene::Random& random, double min_radius_px, double max_radius_px) {
  if (happens(random, 0.5)) return 0.0;
  const double side = happens(random, 0.5) ? 1.0 : -1.0;
  return side / draw(random, min_radius_px, max_radius_px);
}

Points walk(const Arc& arc, double speed_px, double frame_of_middle) {
  Points way;
  for (std::size_t k = 0; k < kFrames; ++k)
    way.push_back(arc.at(speed_px * (static_cast<double>(k) - frame_of_middle)));
  return way;
}

bool all_inside(const Points& way) { return std::ranges::all_of(way, inside_margin); }

bool ends_are_clear(const Points& way, const Barrier& barrier) {
  for (std::size_t k = 0; k < kClearFrames; ++k) {
    if (barrier.distance_px(way[k]) <= kDiscRadius_px + 1.0) return false;
    if (barrier.distance_px(way[way.size() - 1 - k]) <= kDiscRadius_px + 1.0) return false;
  }
  return true;
}

/// The image axis that is nearer to the heading.
Eigen::Vector2d nearest_axis(double angle_rad) {
  const Eigen::Vector2d heading = heading_of(angle_rad);
  return std::abs(heading.x()) >= std::abs(heading.y()) ? Eigen::Vector2d::UnitX() : Eigen::Vector2d::UnitY();
}

struct BehindBarrier {
  Points way;
  Barrier barrier;
};

// Draws a path with a barrier around the position in a random middle frame. Repeats until the path lies inside the
// image.
BehindBarrier draw_behind(scene::Random& random) {
  const double speed_px = draw(random, 3.0, 7.0);
  const double curvature = draw_curvature(random, 80.0, 250.0);
  const double length_px = draw(random, 10.0, 100.0);
  const double middle = kLast * draw(random, 0.4, 0.6);
  for (;;) {
    const double angle_rad = draw(random, 0.0, 2.0 * std::numbers::pi);
    const Arc arc{draw_point(random), angle_rad, curvature};
    const Barrier barrier{arc.through_px, nearest_axis(angle_rad), 0.5 * length_px, 0.5 * length_px + 19.0};
    if (!inside_margin(arc.at(-speed_px * middle)) || !inside_margin(arc.at(speed_px * (kLast - middle)))) continue;
    Points way = walk(arc, speed_px, middle);
    if (all_inside(way)) return {std::move(way), barrier};
  }
}

}  // namespace

Clip occlusion(scene::Random& random) {
  for (;;) {
    BehindBarrier drawn = draw_behind(random);
    if (!ends_are_clear(drawn.way, drawn.barrier)) continue;
    Clip clip;
    clip.ways_px.push_back(std::move(drawn.way));
    clip.barriers.push_back(drawn.barrier);
    return clip;
  }
}

Clip two_behind_one(scene::Random& random) {
  for (;;) {
    BehindBarrier drawn = draw_behind(random);
    if (!ends_are_clear(drawn.way, drawn.barrier)) continue;
    // The path of the other marker leads through the same barrier at about the same time.
    const double angle_rad = std::atan2(drawn.barrier.along.y(), drawn.barrier.along.x()) +
                             draw(random, 30.0, 180.0) * kDegree * (happens(random, 0.5) ? 1.0 : -1.0);
    const Eigen::Vector2d off_px(draw(random, -15.0, 15.0), draw(random, -15.0, 15.0));
    const Arc arc{drawn.barrier.centre_px + off_px, angle_rad, draw_curvature(random, 80.0, 250.0)};
    Points other = walk(arc, draw(random, 3.0, 7.0), kLast * draw(random, 0.45, 0.55));
    if (!all_inside(other) || !ends_are_clear(other, drawn.barrier)) continue;
    if ((other.front() - drawn.way.front()).norm() < 60.0 || (other.back() - drawn.way.back()).norm() < 40.0) continue;
    Clip clip;
    clip.ways_px = {std::move(drawn.way), std::move(other)};
    clip.barriers.push_back(drawn.barrier);
    return clip;
  }
}

Clip swapping(scene::Random& random) {
  constexpr double kMinStart_px = 60.0, kMinEnd_px = 40.0;
  const bool turned_back = happens(random, 0.2);
  for (;;) {
    const double speed_px = draw(random, 2.0, 5.0), other_speed_px = draw(random, 2.0, 5.0);
    const double angle_rad = draw(random, 0.0, 2.0 * std::numbers::pi);
    const double apart_rad = draw(random, 20.0, 120.0) * kDegree * (happens(random, 0.5) ? 1.0 : -1.0);
    const double middle = kLast * draw(random, 0.4, 0.6);
    const Arc one{draw_point(random), angle_rad, draw_curvature(random, 100.0, 400.0)};
    // At the crossing, the markers are displaced perpendicular to their relative motion.
    const Eigen::Vector2d relative_px =
        other_speed_px * heading_of(angle_rad + apart_rad) - speed_px * heading_of(angle_rad);
    const Eigen::Vector2d across = Eigen::Vector2d(-relative_px.y(), relative_px.x()).normalized();
    const Arc two{one.through_px + draw(random, -8.0, 8.0) * across, angle_rad + apart_rad,
                  draw_curvature(random, 100.0, 400.0)};
    Clip clip;
    clip.ways_px = {walk(one, speed_px, middle), walk(two, other_speed_px, middle)};
    if (turned_back) {
      for (std::size_t k = 0; k < kFrames; ++k) {
        const double after = static_cast<double>(k) - middle;
        if (after <= 0.0) continue;
        clip.ways_px[0][k] = one.at(-speed_px * after);
        clip.ways_px[1][k] = two.at(-other_speed_px * after);
      }
    }
    clip.turned_back = turned_back;
    const Points& a = clip.ways_px[0];
    const Points& b = clip.ways_px[1];
    if (!all_inside(a) || !all_inside(b)) continue;
    if ((a.front() - b.front()).norm() < kMinStart_px || (a.back() - b.back()).norm() < kMinEnd_px) continue;
    return clip;
  }
}

}  // namespace mocap::paper_study
