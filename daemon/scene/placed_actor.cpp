#include "scene/placed_actor.h"

#include <Eigen/Geometry>
#include <utility>

namespace mocap::scene {
namespace {

class PlacedActor final : public Actor {
 public:
  PlacedActor(std::unique_ptr<Actor> actor, const Place& place) : actor_(std::move(actor)), delay_s_(place.delay_s) {
    world_from_own_.position << place.at_m, 0.0;
    world_from_own_.rotation = Eigen::AngleAxisd(place.heading_rad, Eigen::Vector3d::UnitZ());
  }

  const MarkerSet& marker_set() const override { return actor_->marker_set(); }

  void at(double t_s, ActorState& into) const override {
    actor_->at(t_s - delay_s_, into);
    for (ActorMarker& marker : into.markers) marker.position.v = world_from_own_ * marker.position.v;
    for (Pose& bone : into.world_from_bone) bone = world_from_own_ * bone;
    for (WorldPoint& ghost : into.ghosts) ghost.v = world_from_own_ * ghost.v;
  }

 private:
  std::unique_ptr<Actor> actor_;
  double delay_s_;
  Pose world_from_own_;
};

}  // namespace

std::unique_ptr<Actor> make_placed_actor(std::unique_ptr<Actor> actor, const Place& place) {
  return std::make_unique<PlacedActor>(std::move(actor), place);
}

}  // namespace mocap::scene
