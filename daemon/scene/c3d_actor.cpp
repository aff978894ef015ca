#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "scene/clip_actor.h"
#include "scene/there_and_back.h"

namespace mocap::scene {
namespace {

class C3dActor final : public Actor {
 public:
  C3dActor(C3d c3d, const std::vector<C3dPointKind>& kinds) : c3d_(std::move(c3d)) {
    marker_set_.name = marker_set_.skeleton.name = "c3d";
    marker_set_.skeleton.bones.push_back({});
    marker_set_.skeleton.bones[0].name = "Points";
    for (std::size_t i = 0; i < kinds.size(); ++i) {
      if (kinds[i] == C3dPointKind::Ghost) ghosts_.push_back(i);
      if (kinds[i] != C3dPointKind::Marker) continue;
      points_.push_back(i);
      marker_set_.markers.push_back({c3d_.labels[i], 0, Eigen::Vector3d::Zero(), {1.0F, 1.0F, 1.0F}});
    }
    set_world_axes();
  }

  const MarkerSet& marker_set() const override { return marker_set_; }

  void at(double t_s, ActorState& into) const override {
    const double last = static_cast<double>(c3d_.frames - 1);
    // A time within 1e-6 samples of a sample takes that sample. A marker next to a gap then needs no interpolation.
    double at = there_and_back_s(t_s, last / c3d_.rate_hz) * c3d_.rate_hz;
    if (std::abs(at - std::round(at)) < 1e-6) at = std::round(at);
    const auto frame = static_cast<std::size_t>(at);
    const double share = at - static_cast<double>(frame);
    into.world_from_bone.clear();
    into.markers.clear();
    into.ghosts.clear();
    for (const std::size_t point : points_) into.markers.push_back(marker_at(frame, share, point));
    for (const std::size_t point : ghosts_) {
      const ActorMarker ghost = marker_at(frame, share, point);
      if (ghost.there) (void)into.ghosts.try_push_back(ghost.position);
    }
  }

 private:
  ActorMarker marker_at(std::size_t frame, double share, std::size_t point) const {
    const C3dSample& before = c3d_.sample(frame, point);
    const C3dSample& after = c3d_.sample(std::min(frame + 1, c3d_.frames - 1), point);
    const bool there = before.there && (share == 0.0 || after.there);
    const Eigen::Vector3d place_m = (1.0 - share) * before.position_m + share * after.position_m;
    return {{there ? Eigen::Vector3d(world_from_file_ * place_m + to_middle_m_) : Eigen::Vector3d::Zero()}, there};
  }

  // Chooses the up axis, y or z of the file: the one along which the markers of one instant are spread more, as people
  // are taller than wide. Moves the centre of all positions to the centre of the volume and keeps the floor.
  void set_world_axes() {
    double spread_y = 0.0, spread_z = 0.0;
    Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
    for (std::size_t frame = 0; frame < c3d_.frames; ++frame) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
      double count = 0.0;
      for (const std::size_t point : points_) {
        const C3dSample& sample = c3d_.sample(frame, point);
        if (!sample.there) continue;
        sum += sample.position_m;
        squares += sample.position_m.cwiseAbs2();
        low = low.cwiseMin(sample.position_m);
        high = high.cwiseMax(sample.position_m);
        count += 1.0;
      }
      if (count < 2.0) continue;
      const Eigen::Vector3d variance = squares / count - (sum / count).cwiseAbs2();
      spread_y += variance.y();
      spread_z += variance.z();
    }
    if (spread_y > spread_z) world_from_file_ << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
    if (high.x() < low.x()) return;  // no sample at all
    to_middle_m_ = -0.5 * (world_from_file_ * (low + high));
    to_middle_m_.z() = 0.0;
  }

  C3d c3d_;
  MarkerSet marker_set_;
  std::vector<std::size_t> points_, ghosts_;
  Eigen::Matrix3d world_from_file_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d to_middle_m_ = Eigen::Vector3d::Zero();
};

}  // namespace

Result<std::unique_ptr<Actor>> make_c3d_actor(C3d c3d) {
  const auto kinds = kinds_of(c3d.labels);
  const auto markers = static_cast<std::size_t>(std::ranges::count(kinds, C3dPointKind::Marker));
  if (markers == 0 || markers > kMaxLabels) {
    return Error{ErrorCode::InvalidArgument, "C3D: the file has " + std::to_string(markers) +
                                                 " labelled markers, expected 1 to " + std::to_string(kMaxLabels)};
  }
  return std::unique_ptr<Actor>(std::make_unique<C3dActor>(std::move(c3d), kinds));
}

}  // namespace mocap::scene
