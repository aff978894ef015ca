#include "calibration/wand/wand.h"

#include <algorithm>

namespace mocap::calibration {
namespace {

struct Reading {
  WandSpots spots;
  double badness = 0.0;
};

bool share_a_spot(const WandSpots& a, const WandSpots& b) {
  return std::ranges::any_of(a, [&](int spot) { return spot >= 0 && std::ranges::find(b, spot) != b.end(); });
}

// How badly three spots make a wand of which `from` is the first marker; negative: not at all.
double badness_of(const Eigen::Vector2d& from, const Eigen::Vector2d& middle, const Eigen::Vector2d& to,
                  double divided_at, const WandShape& shape) {
  const Eigen::Vector2d along = to - from;
  const double length = along.norm();
  if (length < shape.shortest_px) return -1.0;
  const Eigen::Vector2d u = along / length;
  const Eigen::Vector2d off = middle - from;
  const double straight = shape.straight_px + shape.straight_share * length;
  const double beside = std::abs(u.x() * off.y() - u.y() * off.x()) / straight;
  const double divided = std::abs(u.dot(off) / length - divided_at) / shape.ratio_slack;
  return beside <= 1.0 && divided <= 1.0 ? beside * beside + divided * divided : -1.0;
}

std::vector<Reading> readings_of_three(std::span<const Eigen::Vector2d> spots, const Wand& wand,
                                       const WandShape& shape) {
  std::vector<Reading> readings;
  const double divided_at = wand.marks_m[1] / wand.length_m();
  const auto n = static_cast<int>(spots.size());
  const auto at = [&](int i) { return spots[static_cast<std::size_t>(i)]; };
  for (int from = 0; from < n; ++from) {
    for (int to = 0; to < n; ++to) {
      if (to == from || (wand.reads_both_ways() && to < from)) continue;
      for (int middle = 0; middle < n; ++middle) {
        if (middle == from || middle == to) continue;
        const double badness = badness_of(at(from), at(middle), at(to), divided_at, shape);
        if (badness >= 0.0) readings.push_back({{from, middle, to}, badness});
      }
    }
  }
  return readings;
}

}  // namespace

WandShape wand_shape(bool lens_known) {
  WandShape shape;
  if (!lens_known) {
    shape.straight_px = 2.0;
    shape.straight_share = 0.03;
  }
  return shape;
}

WandLook find_wand(std::span<const Eigen::Vector2d> spots_px, const Wand& wand, const WandShape& shape) {
  WandLook look;
  if (spots_px.size() > shape.most_spots) return look;
  if (wand.marks_m.size() == 2) {
    look.seen = spots_px.size() == 2 && (spots_px[1] - spots_px[0]).norm() >= shape.shortest_px;
    if (look.seen) look.spots = {0, 1, -1};
    look.twice = spots_px.size() == 4;
    return look;
  }
  const std::vector<Reading> readings = readings_of_three(spots_px, wand, shape);
  if (readings.empty()) return look;
  const auto best = std::ranges::min_element(readings, {}, &Reading::badness);
  look.spots = best->spots;
  // Another reading that fits half as well leaves it open which one is the wand.
  look.seen = std::ranges::none_of(
      readings, [&](const Reading& other) { return &other != &*best && other.badness < best->badness + 0.5; });
  look.twice =
      std::ranges::any_of(readings, [&](const Reading& other) { return !share_a_spot(other.spots, best->spots); });
  return look;
}

}  // namespace mocap::calibration
