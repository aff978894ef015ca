#include "scene/prop_actor.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

namespace mocap::scene {
namespace {

using Eigen::Vector3d;

// A marker set with one bone and markers without offsets.
MarkerSet one_bone_set(const char* name, std::size_t count) {
  MarkerSet set;
  set.name = name;
  set.skeleton.name = name;
  set.skeleton.bones.emplace_back().name = name;
  for (std::size_t i = 0; i < count; ++i) set.markers.emplace_back().name = fmt::format("{}{}", name, i + 1);
  return set;
}

class WavedWand final : public Actor {
 public:
  explicit WavedWand(std::vector<double> marks_m)
      : marks_m_(std::move(marks_m)), marker_set_(one_bone_set("wand", marks_m_.size())) {
    for (std::size_t i = 0; i < marks_m_.size(); ++i) marker_set_.markers[i].offset_m.x() = marks_m_[i];
  }

  const MarkerSet& marker_set() const override { return marker_set_; }

  void at(double t_s, ActorState& into) const override {
    const double t = std::max(0.0, t_s);
    // A slow path through the volume plus faster strokes; the frequencies have no short common period.
    const Vector3d middle = Vector3d(0.0, 0.0, 1.15) +
                            Vector3d(1.05, 1.05, 0.55).cwiseProduct(wave({0.043, 0.057, 0.071}, t)) +
                            Vector3d(0.25, 0.25, 0.2).cwiseProduct(wave({0.31, 0.37, 0.43}, t));
    const double yaw = std::numbers::pi * std::sin(2.0 * std::numbers::pi * 0.11 * t);
    const double tilt = 1.2 * std::sin(2.0 * std::numbers::pi * 0.17 * t + 1.0);
    const Vector3d along(std::cos(yaw) * std::cos(tilt), std::sin(yaw) * std::cos(tilt), std::sin(tilt));
    into.markers.clear();
    into.world_from_bone.clear();
    into.ghosts.clear();
    for (const double mark : marks_m_)
      into.markers.push_back({WorldPoint{middle + (mark - 0.5 * marks_m_.back()) * along}, true});
  }

 private:
  static Vector3d wave(const Vector3d& hz, double t) {
    return (2.0 * std::numbers::pi * t * hz + Vector3d(0.4, 2.1, 3.3)).array().sin();
  }

  std::vector<double> marks_m_;
  MarkerSet marker_set_;
};

class LyingFrame final : public Actor {
 public:
  LyingFrame(double long_m, double short_m) : marker_set_(one_bone_set("frame", 3)) {
    marker_set_.markers[1].offset_m.x() = long_m;
    marker_set_.markers[2].offset_m.y() = short_m;
  }

  const MarkerSet& marker_set() const override { return marker_set_; }

  void at(double, ActorState& into) const override {
    into.markers.clear();
    into.world_from_bone.clear();
    into.ghosts.clear();
    for (const MarkerOnBone& marker : marker_set_.markers) into.markers.push_back({WorldPoint{marker.offset_m}, true});
  }

 private:
  MarkerSet marker_set_;
};

// Reads numbers in mm, separated by commas. Returns metres.
std::optional<std::vector<double>> numbers_of(std::string_view text) {
  std::vector<double> numbers;
  for (const char* at = text.data(); at != text.data() + text.size();) {
    double mm = 0.0;
    const auto [end, error] = std::from_chars(at, text.data() + text.size(), mm);
    if (error != std::errc{} || !(mm >= 0.0 && mm <= 10000.0)) return std::nullopt;
    numbers.push_back(1e-3 * mm);
    at = end;
    if (at != text.data() + text.size() && *at++ != ',') return std::nullopt;
  }
  return numbers;
}

std::string_view kind_of(std::string_view text) { return text.substr(0, text.find(':')); }

}  // namespace

bool is_prop(std::string_view text) { return kind_of(text) == "wand" || kind_of(text) == "frame"; }

Result<std::unique_ptr<Actor>> make_prop_actor(std::string_view text) {
  const std::string_view kind = kind_of(text);
  const auto colon = text.find(':');
  auto numbers = numbers_of(colon == std::string_view::npos ? std::string_view{} : text.substr(colon + 1));
  const bool given = colon != std::string_view::npos;
  if (kind == "wand" && !given) numbers = {{0.0, 0.16, 0.5}};
  if (kind == "frame" && !given) numbers = {{0.6, 0.4}};
  if (kind == "wand" && numbers && numbers->size() >= 2 && numbers->size() <= kMaxLabels)
    return std::unique_ptr<Actor>(std::make_unique<WavedWand>(std::move(*numbers)));
  if (kind == "frame" && numbers && numbers->size() == 2)
    return std::unique_ptr<Actor>(std::make_unique<LyingFrame>((*numbers)[0], (*numbers)[1]));
  return Error{ErrorCode::InvalidArgument,
               fmt::format("'{}' is not a wand or frame, expected wand:0,160,500 (positions of the markers, mm) or "
                           "frame:600,400 (lengths of the arms, mm)",
                           text)};
}

}  // namespace mocap::scene
