#include "chaos/scripted_actor.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace mocap::chaos {
namespace {

constexpr double kLyingDown_s = 0.6;    // a person lies down or stands up in this time
constexpr double kLyingHeight_m = 0.2;  // of the body's axis above the floor
constexpr double kPassingBy_m = 0.5;    // two people who exchange places keep this distance from the line between them

// 0 at 0, 1 at 1, without a step in the velocity.
double smooth(double share) {
  const double within = std::clamp(share, 0.0, 1.0);
  return within * within * (3.0 - 2.0 * within);
}

class ScriptedActor final : public scene::Actor {
 public:
  ScriptedActor(std::unique_ptr<scene::Actor> actor, const ActorPlace& place, std::vector<Fault> faults)
      : actor_(std::move(actor)), place_(place), faults_(std::move(faults)) {}

  const MarkerSet& marker_set() const override { return actor_->marker_set(); }

  void at(double t_s, scene::ActorState& into) const override {
    actor_->at(t_s, into);
    const Pose world_from_own = pose_at(t_s);
    const bool away = active_fault(faults_, FaultKind::SubjectAway, place_.subject, t_s) != nullptr;
    for (scene::ActorMarker& marker : into.markers) {
      marker.position.v = world_from_own * marker.position.v;
      marker.there = marker.there && !away;
    }
    for (Pose& bone : into.world_from_bone) bone = world_from_own * bone;
  }

 private:
  Pose pose_at(double t_s) const {
    const double lying = lying_at(t_s);
    const Eigen::Vector2d at_m = place_at(t_s);
    Pose pose;
    pose.position << at_m, lying * kLyingHeight_m;
    pose.rotation = Eigen::AngleAxisd(0.5 * std::numbers::pi * lying, Eigen::Vector3d::UnitX());
    return pose;
  }

  // 0: the person stands, 1: the person lies. If two faults overlap, the one that lays the person lower counts, so that
  // the height has no step.
  double lying_at(double t_s) const {
    double lying = 0.0;
    for (const Fault& lies : faults_) {
      if (lies.kind != FaultKind::SubjectLies || lies.target != place_.subject) continue;
      lying = std::max(
          lying, std::min(smooth((t_s - lies.from_s) / kLyingDown_s), smooth((lies.to_s() - t_s) / kLyingDown_s)));
    }
    return lying;
  }

  // Nobody can begin to change places on the way: a swap that would begin during another one does not happen.
  Eigen::Vector2d place_at(double t_s) const {
    Eigen::Vector2d from_m = place_.own_m, to_m = place_.other_m;
    double arrived_s = 0.0;
    for (const Fault& swap : faults_) {
      if (swap.kind != FaultKind::SubjectsSwap || swap.from_s < arrived_s || t_s < swap.from_s) continue;
      if (t_s < swap.to_s()) return on_the_way(from_m, to_m, smooth((t_s - swap.from_s) / swap.for_s));
      std::swap(from_m, to_m);
      arrived_s = swap.to_s();
    }
    return from_m;
  }

  static Eigen::Vector2d on_the_way(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m, double share) {
    const Eigen::Vector2d way_m = to_m - from_m;
    if (way_m.isZero()) return from_m;
    const Eigen::Vector2d side = Eigen::Vector2d(-way_m.y(), way_m.x()).normalized();
    return from_m + share * way_m + kPassingBy_m * std::sin(std::numbers::pi * share) * side;
  }

  std::unique_ptr<scene::Actor> actor_;
  ActorPlace place_;
  std::vector<Fault> faults_;
};

}  // namespace

std::unique_ptr<scene::Actor> make_scripted_actor(std::unique_ptr<scene::Actor> actor, const ActorPlace& place,
                                                  std::vector<Fault> faults) {
  return std::make_unique<ScriptedActor>(std::move(actor), place, std::move(faults));
}

}  // namespace mocap::chaos
