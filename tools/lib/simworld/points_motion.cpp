#include "lib/simworld/points_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "lib/simworld/trc_file.h"
#include "scene/bvh.h"
#include "scene/c3d.h"
#include "scene/clip_actor.h"
#include "scene/random.h"

namespace mocap::simworld {
namespace {

using Eigen::Vector3d;

// People stand on a grid with this spacing. Each person is ahead of the previous person by this time, or by less in a
// short recording.
constexpr double kApart_m = 0.9;
constexpr double kOutOfStep_s = 0.73;

// The lights of one recording, played forwards and backwards in an endless loop.
class Clip {
 public:
  virtual ~Clip() = default;

  virtual double length_s() const = 0;
  virtual double rate_hz() const = 0;
  virtual void at(double t_s, std::vector<Light>& into) const = 0;
};

// The measured points of a C3D or TRC file, without points that a model computed. Rotated so that z is up, and moved so
// that the centre of all positions is the centre of the volume.
class PointClip final : public Clip {
 public:
  explicit PointClip(scene::C3d points) : points_(std::move(points)) {
    const auto kinds = scene::kinds_of(points_.labels);
    for (const auto kind : {scene::C3dPointKind::Marker, scene::C3dPointKind::Ghost}) {
      for (std::size_t i = 0; i < kinds.size(); ++i) {
        if (kinds[i] == kind) lights_.push_back({i, kind == scene::C3dPointKind::Marker});
      }
    }
    stand_up();
  }

  std::size_t light_count() const { return lights_.size(); }
  double length_s() const override { return static_cast<double>(points_.frames - 1) / points_.rate_hz; }
  double rate_hz() const override { return points_.rate_hz; }

  void at(double t_s, std::vector<Light>& into) const override {
    // Interpolates between samples. At the rate of the recording, each sample is reproduced exactly.
    const double last = static_cast<double>(points_.frames - 1);
    double at = last > 0.0 ? std::fmod(t_s * points_.rate_hz, 2.0 * last) : 0.0;
    at = at > last ? 2.0 * last - at : at;
    if (std::abs(at - std::round(at)) < 1e-6) at = std::round(at);
    const auto frame = static_cast<std::size_t>(at);
    const double share = at - static_cast<double>(frame);
    into.clear();
    for (const auto& [point, is_labelled] : lights_) {
      const scene::C3dSample& before = points_.sample(frame, point);
      const scene::C3dSample& after = points_.sample(std::min(frame + 1, points_.frames - 1), point);
      const bool there = before.there && (share == 0.0 || after.there);
      const Vector3d place = (1.0 - share) * before.position_m + share * after.position_m;
      into.push_back({there ? Vector3d(world_from_file_ * place + to_middle_) : Vector3d::Zero(), there, is_labelled});
    }
  }

 private:
  struct Source {
    std::size_t point;
    bool is_labelled;
  };

  // Chooses y or z as the vertical axis: the axis along which the markers of one instant have the larger variance,
  // because people are taller than wide.
  void stand_up() {
    double spread_y = 0.0, spread_z = 0.0;
    Vector3d low = Vector3d::Constant(1e9), high = -low;
    for (std::size_t frame = 0; frame < points_.frames; ++frame) {
      Vector3d sum = Vector3d::Zero(), squares = Vector3d::Zero();
      double count = 0.0;
      for (const auto& [point, is_labelled] : lights_) {
        const scene::C3dSample& sample = points_.sample(frame, point);
        if (!sample.there || !is_labelled) continue;
        sum += sample.position_m;
        squares += sample.position_m.cwiseAbs2();
        low = low.cwiseMin(sample.position_m);
        high = high.cwiseMax(sample.position_m);
        count += 1.0;
      }
      if (count < 2.0) continue;
      const Vector3d variance = squares / count - (sum / count).cwiseAbs2();
      spread_y += variance.y();
      spread_z += variance.z();
    }
    if (spread_y > spread_z) world_from_file_ << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
    if (high.x() >= low.x()) to_middle_ = -0.5 * (world_from_file_ * (low + high));
    to_middle_.z() = 0.0;
  }

  scene::C3d points_;
  std::vector<Source> lights_;  // markers first
  Eigen::Matrix3d world_from_file_ = Eigen::Matrix3d::Identity();
  Vector3d to_middle_ = Vector3d::Zero();
};

// The joints of a BVH file.
class JointClip final : public Clip {
 public:
  JointClip(std::unique_ptr<scene::Actor> actor, double length_s, double rate_hz)
      : actor_(std::move(actor)), length_s_(length_s), rate_hz_(rate_hz) {}

  double length_s() const override { return length_s_; }
  double rate_hz() const override { return rate_hz_; }
  void at(double t_s, std::vector<Light>& into) const override {
    actor_->at(t_s, state_);
    into.clear();
    for (const scene::ActorMarker& marker : state_.markers) into.push_back({marker.position.v, marker.there, true});
  }

 private:
  std::unique_ptr<scene::Actor> actor_;
  double length_s_;
  double rate_hz_;
  mutable scene::ActorState state_;
};

class Crowd final : public PointMotion {
 public:
  Crowd(std::unique_ptr<Clip> clip, std::size_t markers) : clip_(std::move(clip)) {
    clip_->at(0.0, one_);
    const auto labelled = static_cast<std::size_t>(std::ranges::count(one_, true, &Light::is_labelled));
    markers_ = markers == 0 ? labelled : markers;
    people_ = (markers_ + labelled - 1) / labelled;
    unlabelled_ = one_.size() - labelled;
    step_s_ = std::min(kOutOfStep_s, 0.5 * clip_->length_s() / static_cast<double>(people_));
  }

  std::size_t light_count() const override { return markers_ + unlabelled_; }
  // Ends when the first person reaches the end of the clip: the reversal there is an unrealistic jump of the velocity.
  double length_s() const override { return clip_->length_s() - step_s_ * static_cast<double>(people_ - 1); }
  double rate_hz() const override { return clip_->rate_hz(); }

  void at(double t_s, std::vector<Light>& into) const override {
    into.clear();
    const auto columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(people_))));
    const double middle = 0.5 * static_cast<double>(columns - 1);
    for (std::size_t person = 0; person < people_; ++person) {
      clip_->at(t_s + static_cast<double>(person) * step_s_, one_);
      const Vector3d place(kApart_m * (static_cast<double>(person % columns) - middle),
                           kApart_m * (static_cast<double>(person / columns) - middle), 0.0);
      for (const Light& light : one_) {
        if (light.is_labelled && into.size() < markers_) into.push_back({light.position + place, light.there, true});
      }
    }
    if (unlabelled_ == 0) return;
    clip_->at(t_s, one_);
    std::ranges::copy_if(one_, std::back_inserter(into), [](const Light& light) { return !light.is_labelled; });
  }

 private:
  std::unique_ptr<Clip> clip_;
  mutable std::vector<Light> one_;
  std::size_t markers_ = 0;
  std::size_t people_ = 1;
  std::size_t unlabelled_ = 0;
  double step_s_ = 0.0;
};

class Swarm final : public PointMotion {
 public:
  Swarm(std::size_t markers, std::uint64_t seed) {
    scene::Random random(seed);
    for (std::size_t m = 0; m < markers; ++m) {
      Way& way = ways_.emplace_back();
      way.middle = {1.6 * random.uniform() - 0.8, 1.6 * random.uniform() - 0.8, 0.3 + 1.4 * random.uniform()};
      for (int axis = 0; axis < 3; ++axis) {
        way.reach_m[axis] = 0.1 + 0.25 * random.uniform();
        way.pace_rad_s[axis] = 1.0 + 4.0 * random.uniform();
        way.phase_rad[axis] = 2.0 * std::numbers::pi * random.uniform();
      }
    }
  }

  std::size_t light_count() const override { return ways_.size(); }
  double length_s() const override { return 10.0; }
  double rate_hz() const override { return 100.0; }

  void at(double t_s, std::vector<Light>& into) const override {
    into.clear();
    for (const Way& way : ways_) {
      const Vector3d swing = (way.pace_rad_s * t_s + way.phase_rad).array().sin();
      into.push_back({way.middle + way.reach_m.cwiseProduct(swing), true, true});
    }
  }

 private:
  struct Way {
    Vector3d middle, reach_m, pace_rad_s, phase_rad;
  };
  std::vector<Way> ways_;
};

Result<std::string> read_whole(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return Error{ErrorCode::NotFound, fmt::format("motion: cannot read '{}'; is the path right?", file)};
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

Error in_file(const std::string& file, const Error& error) {
  return {error.code, fmt::format("motion '{}': {}", file, error.message)};
}

Result<std::unique_ptr<Clip>> clip_of(scene::C3d points) {
  const auto kinds = scene::kinds_of(points.labels);
  if (points.frames == 0 || std::ranges::count(kinds, scene::C3dPointKind::Marker) == 0) {
    return Error{ErrorCode::InvalidArgument, "it has no labelled markers"};
  }
  auto clip = std::make_unique<PointClip>(std::move(points));
  if (clip->light_count() > kMaxMarkers / 2) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("it has {} points, expected {} at most", clip->light_count(), kMaxMarkers / 2)};
  }
  return std::unique_ptr<Clip>(std::move(clip));
}

Result<std::unique_ptr<Clip>> clip_of(scene::Bvh bvh) {
  const double rate_hz = 1.0 / bvh.frame_time_s;
  const double length_s = static_cast<double>(bvh.frames - 1) * bvh.frame_time_s;
  auto actor = scene::make_bvh_actor(std::move(bvh), std::nullopt, {.unit_m = 0.0, .t_pose_s = 0.0});
  if (!actor) return actor.error();
  return std::unique_ptr<Clip>(std::make_unique<JointClip>(std::move(*actor), length_s, rate_hz));
}

Result<std::unique_ptr<Clip>> read_clip(const std::string& file) {
  const auto text = read_whole(file);
  if (!text) return text.error();
  const std::string extension = std::filesystem::path(file).extension().string();
  if (extension == ".bvh") {
    auto bvh = scene::parse_bvh(*text);
    if (!bvh) return bvh.error();
    return clip_of(std::move(*bvh));
  }
  if (extension != ".c3d" && extension != ".trc") {
    return Error{ErrorCode::InvalidArgument, "its name ends neither in .c3d nor in .bvh nor in .trc"};
  }
  auto points = extension == ".trc" ? parse_trc(*text) : scene::parse_c3d(std::as_bytes(std::span(*text)));
  if (!points) return points.error();
  return clip_of(std::move(*points));
}

}  // namespace

Result<std::unique_ptr<PointMotion>> load_motion(const std::string& file, std::size_t markers) {
  auto clip = read_clip(file);
  if (!clip) return in_file(file, clip.error());
  return std::unique_ptr<PointMotion>(std::make_unique<Crowd>(std::move(*clip), markers));
}

std::unique_ptr<PointMotion> make_swarm(std::size_t markers, std::uint64_t seed) {
  return std::make_unique<Swarm>(markers, seed);
}

}  // namespace mocap::simworld
