#include "eval/points_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

#include "scene/bvh.h"
#include "scene/c3d.h"
#include "scene/clip_actor.h"
#include "scene/random.h"

namespace mocap::eval {
namespace {

using Eigen::Vector3d;

struct Clip {
  std::unique_ptr<scene::Actor> actor;
  double length_s = 0.0;
  double rate_hz = 0.0;
};

// People stand on a grid this wide, and each is this much later than the one before.
constexpr double kApart_m = 0.9;
constexpr double kOutOfStep_s = 0.73;

class Crowd final : public PointMotion {
 public:
  Crowd(Clip clip, std::size_t markers) : clip_(std::move(clip)) {
    clip_.actor->at(0.0, state_);
    markers_of_one_ = state_.markers.size();
    ghost_count_ = most_ghosts();
    markers_ = markers == 0 ? markers_of_one_ : markers;
    people_ = (markers_ + markers_of_one_ - 1) / markers_of_one_;
  }

  std::size_t light_count() const override { return markers_ + ghost_count_; }
  double length_s() const override { return clip_.length_s; }
  double rate_hz() const override { return clip_.rate_hz; }

  void at(double t_s, std::vector<Light>& into) const override {
    into.clear();
    const auto columns = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(people_))));
    for (std::size_t person = 0; person < people_; ++person) {
      clip_.actor->at(t_s + static_cast<double>(person) * kOutOfStep_s, state_);
      Vector3d place = Vector3d::Zero();
      const double middle = 0.5 * static_cast<double>(columns - 1);
      place.x() = kApart_m * (static_cast<double>(person % columns) - middle);
      place.y() = kApart_m * (static_cast<double>(person / columns) - middle);
      for (const scene::ActorMarker& marker : state_.markers) {
        if (into.size() < markers_) into.push_back({marker.position.v + place, marker.there, true});
      }
    }
    clip_.actor->at(t_s, state_);
    for (std::size_t i = 0; i < ghost_count_; ++i) {
      const bool there = i < state_.ghosts.size();
      into.push_back({there ? state_.ghosts[i].v : Vector3d::Zero(), there, false});
    }
  }

 private:
  std::size_t most_ghosts() const {
    std::size_t most = 0;
    for (double t_s = 0.0; t_s <= clip_.length_s; t_s += 1.0 / clip_.rate_hz) {
      clip_.actor->at(t_s, state_);
      most = std::max(most, state_.ghosts.size());
    }
    return most;
  }

  Clip clip_;
  mutable scene::ActorState state_;
  std::size_t markers_of_one_ = 0;
  std::size_t markers_ = 0;
  std::size_t people_ = 1;
  std::size_t ghost_count_ = 0;
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

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  std::string cell;
  while (std::getline(stream, cell, '\t')) {
    while (!cell.empty() && (cell.back() == '\r' || cell.back() == ' ')) cell.pop_back();
    cells.push_back(cell);
  }
  return cells;
}

std::optional<double> number_of(const std::string& cell) {
  double value = 0.0;
  std::istringstream stream(cell);
  stream.imbue(std::locale::classic());
  if (!(stream >> value)) return std::nullopt;
  return value;
}

// Lines of a TRC file after its header: frame, time, x y z of each marker.
void add_trc_frame(const std::vector<std::string>& cells, double unit_m, scene::C3d& into) {
  for (std::size_t m = 0; m < into.labels.size(); ++m) {
    scene::C3dSample sample;
    Vector3d point = Vector3d::Zero();
    sample.there = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t cell = 2 + 3 * m + axis;
      const auto value = cell < cells.size() ? number_of(cells[cell]) : std::nullopt;
      sample.there = sample.there && value;
      point[static_cast<Eigen::Index>(axis)] = value.value_or(0.0) * unit_m;
    }
    sample.there = sample.there && !point.isZero();
    sample.position_m = point;
    into.samples.push_back(sample);
  }
  ++into.frames;
}

Result<scene::C3d> parse_trc(const std::string& text) {
  const Error broken{ErrorCode::InvalidArgument, "it is no whole TRC file: rates, names and frames are expected"};
  std::istringstream stream(text);
  std::vector<std::string> header(4);
  for (std::string& line : header) {
    if (!std::getline(stream, line)) return broken;
  }
  const auto facts = cells_of(header[2]);
  const auto names = cells_of(header[3]);
  const auto rate = facts.empty() ? std::nullopt : number_of(facts[0]);
  if (!rate || !(*rate > 0.0) || facts.size() < 5 || names.size() < 3) return broken;
  scene::C3d clip;
  clip.rate_hz = *rate;
  for (std::size_t i = 2; i < names.size(); i += 3) clip.labels.push_back(names[i].empty() ? "*" : names[i]);
  const double unit_m = facts[4] == "m" ? 1.0 : 0.001;
  for (std::string line; std::getline(stream, line);) {
    const auto cells = cells_of(line);
    if (cells.size() > 2 && number_of(cells[0])) add_trc_frame(cells, unit_m, clip);
  }
  if (clip.frames == 0) return broken;
  return clip;
}

Result<Clip> clip_of(scene::C3d points) {
  Clip clip;
  clip.rate_hz = points.rate_hz;
  clip.length_s = static_cast<double>(points.frames - 1) / points.rate_hz;
  auto actor = scene::make_c3d_actor(std::move(points));
  if (!actor) return actor.error();
  clip.actor = std::move(*actor);
  return clip;
}

Result<Clip> clip_of(scene::Bvh bvh) {
  Clip clip;
  clip.rate_hz = 1.0 / bvh.frame_time_s;
  clip.length_s = static_cast<double>(bvh.frames - 1) * bvh.frame_time_s;
  auto actor = scene::make_bvh_actor(std::move(bvh), std::nullopt, {.unit_m = 0.0, .t_pose_s = 0.0});
  if (!actor) return actor.error();
  clip.actor = std::move(*actor);
  return clip;
}

Result<Clip> read_clip(const std::string& file) {
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

}  // namespace mocap::eval
