#include "paper_study/multiview.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "base/expects.h"
#include "detect/blob_detector.h"
#include "fusion/fusion.h"
#include "geometry/lens.h"
#include "label/body_labeller.h"
#include "paper_study/way.h"
#include "scene/render.h"
#include "scene/ring_rig.h"
#include "solve/tree_solver.h"
#include "synchronise/frame_aligner.h"
#include "track2d/following_blob_tracker.h"
#include "track3d/kalman_marker_tracker.h"

namespace mocap::paper_study {
namespace {

constexpr double kMetresPerPixel = 0.005;
constexpr double kMiddleHeight_m = 1.3;  // the plane extends from 0.1 to 2.5 m above the floor
constexpr double kLeastDepth_m = 0.1,
                 kMostDepth_m = 0.4;  // distance of other markers in front of or behind the labelled marker
constexpr double kWallOff_m = 0.5;    // distance of the barrier from the plane of the labelled marker
constexpr double kOnMarker_m = 0.03;
constexpr double kOffMarker_m = 15.0 * kMetresPerPixel;
constexpr std::size_t kLabelWithin = 8;  // frames
constexpr std::uint64_t kPlaneSeed = 0x9A9E4;

/// Pose of a clip's image plane in the volume: upright and facing one of the cameras, whose image is about the clip.
struct ClipPlane {
  Eigen::Vector3d right, normal;  // the normal points to the camera
  std::vector<double> depths_m;   // by marker: distance from the plane towards the camera

  ClipPlane(const Rig& rig, std::size_t markers, std::uint64_t seed) {
    scene::Random random(seed ^ kPlaneSeed);
    const CameraModel& front = rig[random.bits() % rig.size()];
    normal = front.centre().v;
    normal.z() = 0.0;
    normal.normalize();
    right = Eigen::Vector3d::UnitZ().cross(normal);
    depths_m.push_back(0.0);
    while (depths_m.size() < markers) {
      depths_m.push_back(draw(random, kLeastDepth_m, kMostDepth_m) * (happens(random, 0.5) ? 1.0 : -1.0));
    }
  }
  Eigen::Vector3d direction(const Eigen::Vector2d& px) const {
    return kMetresPerPixel * (px.x() * right - px.y() * Eigen::Vector3d::UnitZ());
  }
  WorldPoint at(const Eigen::Vector2d& px, double depth_m) const {
    const Eigen::Vector2d middle_px(0.5 * (kWidth_px - 1), 0.5 * (kHeight_px - 1));
    return {Eigen::Vector3d(0.0, 0.0, kMiddleHeight_m) + direction(px - middle_px) + depth_m * normal};
  }
};

using Quad = std::array<Eigen::Vector2d, 4>;

bool inside(const Quad& quad, const Eigen::Vector2d& point) {
  int left = 0;
  for (std::size_t i = 0; i < quad.size(); ++i) {
    const Eigen::Vector2d edge = quad[(i + 1) % 4] - quad[i], to = point - quad[i];
    if (edge.x() * to.y() - edge.y() * to.x() >= 0.0) ++left;
  }
  return left == 0 || left == 4;
}

/// The image of the barrier in a camera. Empty if the barrier is behind the markers or behind the camera.
std::optional<Quad> wall_in(const CameraModel& camera, const ClipPlane& plane, const Barrier& barrier) {
  const WorldPoint centre = plane.at(barrier.centre_px, kWallOff_m);
  if ((camera.centre().v - centre.v).dot(plane.normal) <= 0.0) return std::nullopt;
  const Eigen::Vector3d along = plane.direction(barrier.half_length_px * barrier.along);
  const Eigen::Vector2d across_px(-barrier.along.y(), barrier.along.x());
  const Eigen::Vector3d across = plane.direction(barrier.half_height_px * across_px);
  constexpr std::array<std::pair<double, double>, 4> kCorners{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  Quad quad;
  for (std::size_t i = 0; i < quad.size(); ++i) {
    const auto corner = geometry::project(camera, {centre.v + kCorners[i].first * along + kCorners[i].second * across});
    if (!corner) return std::nullopt;
    quad[i] = corner->v;
  }
  return quad;
}

/// One camera: draws the clip, detects its blobs and tracks them.
class Post {
 public:
  Post(CameraId id, const CameraModel& model, const scene::ImageSettings& image)
      : id_(id),
        model_(model),
        image_(image),
        renderer_(model.width_px, model.height_px, image, id.value),
        tracker_(track2d::make_blob_tracker({})),
        pixels_(static_cast<std::size_t>(model.width_px) * static_cast<std::size_t>(model.height_px)) {
    auto detector = detect::make_blob_detector({}, PixelFormat::Mono8, model.width_px, model.height_px);
    MOCAP_EXPECTS(detector.has_value());
    detector_ = std::move(*detector);
  }

  void start_clip() { tracker_ = track2d::make_blob_tracker({}); }

  void see(const Clip& clip, const ClipPlane& plane, std::size_t frame, Timestamp at, BlobFrame& into) {
    discs_.clear();
    for (std::size_t i = 0; i < clip.ways_px.size(); ++i) add(plane.at(clip.ways_px[i][frame], plane.depths_m[i]));
    renderer_.render(discs_, frame, pixels_);
    for (const Barrier& barrier : clip.barriers) {
      if (const auto wall = wall_in(model_, plane, barrier)) hide(*wall);
    }
    const auto stride = static_cast<std::size_t>(model_.width_px);
    into.camera = id_;
    into.number = frame;
    into.exposed_at = into.received_at = into.detected_at = at;
    into.blobs = detector_->detect({pixels_, stride, model_.width_px, model_.height_px, PixelFormat::Mono8}).blobs;
    tracker_->track(into);
  }

 private:
  void add(const WorldPoint& point) {
    const auto pixel = geometry::project(model_, point);
    if (!pixel) return;
    const double depth_m = (model_.camera_from_world * point).v.z();
    const double radius_px = std::max(image_.least_radius_px, model_.lens.fx_px * image_.marker_radius_m / depth_m);
    discs_.push_back({pixel->v, pixel->v, radius_px, 1.0});
  }

  void hide(const Quad& wall) {
    for (int y = 0; y < model_.height_px; ++y) {
      for (int x = 0; x < model_.width_px; ++x) {
        std::byte& pixel = pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(model_.width_px) +
                                   static_cast<std::size_t>(x)];
        const bool bright = std::to_integer<int>(pixel) > image_.background_grey + 8.0 * image_.read_noise_grey;
        if (bright && inside(wall, {static_cast<double>(x), static_cast<double>(y)})) {
          pixel = static_cast<std::byte>(std::lround(image_.background_grey));
        }
      }
    }
  }

  CameraId id_;
  const CameraModel& model_;
  scene::ImageSettings image_;
  scene::Renderer renderer_;
  std::unique_ptr<Detector> detector_;
  std::unique_ptr<BlobTracker> tracker_;
  std::vector<std::byte> pixels_;
  std::vector<scene::Disc> discs_;
};

fusion::Fusion make_row(const Rig& rig) {
  fusion::FusionParts row;
  row.matcher = associate::make_matcher({}, rig);
  row.triangulator = associate::make_triangulator({}, rig);
  row.tracker = track3d::make_marker_tracker({});
  row.labeller = label::make_labeller({}, {});
  row.solver = solve::make_skeleton_solver({}, {});
  return {std::move(row), static_cast<std::uint32_t>(rig.size())};
}

/// Keeps the 3D track that has the label, and whether the label was lost.
class Label3d {
 public:
  explicit Label3d(LossRule rule) : rule_(rule) {}

  void follow(const Snapshot& snapshot, const WorldPoint& truth, std::size_t frame, bool last) {
    if (!track_.names_something()) {
      give(snapshot, truth);
      if (!track_.names_something() && frame + 1 >= kLabelWithin) lost_ = true;
      return;
    }
    const auto borne = [&](const UnlabelledMarker& marker) { return marker.track == track_; };
    const auto* found = std::find_if(snapshot.unlabelled.begin(), snapshot.unlabelled.end(), borne);
    const bool held = found != snapshot.unlabelled.end() && (found->position.v - truth.v).norm() <= kOffMarker_m;
    if (!held && (last || rule_ == LossRule::AnyMiss)) lost_ = true;
  }
  bool lost() const { return lost_ || !track_.names_something(); }

 private:
  void give(const Snapshot& snapshot, const WorldPoint& truth) {
    for (const UnlabelledMarker& marker : snapshot.unlabelled) {
      if ((marker.position.v - truth.v).norm() <= kOnMarker_m) track_ = marker.track;
    }
  }

  LossRule rule_;
  TrackId track_;
  bool lost_ = false;
};

class Hall {
 public:
  Hall() : rig_(scene::ring_rig({.cameras = kMultiviewCameras})), frames_(rig_.size()) {
    for (std::uint32_t i = 0; i < rig_.size(); ++i) posts_.emplace_back(CameraId{i}, rig_[i], scene::ImageSettings{});
  }

  bool loses(const Clip& clip, std::uint64_t seed) {
    const ClipPlane plane(rig_, clip.ways_px.size(), seed);
    const auto row = std::make_unique<fusion::Fusion>(make_row(rig_));
    synchronise::FrameAligner aligner({}, rig_.size());
    for (Post& post : posts_) post.start_clip();
    Label3d label(loss_rule_of(clip.situation));
    for (std::size_t frame = 0; frame < clip.frames(); ++frame) {
      const Timestamp at = from_ns(0) + from_s(static_cast<double>(frame) / kFrameRate_Hz);
      for (std::size_t i = 0; i < posts_.size(); ++i) {
        posts_[i].see(clip, plane, frame, at, frames_[i]);
        aligner.add(frames_[i]);
      }
      const std::optional<FrameSet> set = aligner.take(at);
      MOCAP_EXPECTS(set.has_value());
      label.follow(row->step(*set), plane.at(clip.ways_px[0][frame], 0.0), frame, frame + 1 == clip.frames());
    }
    return label.lost();
  }

 private:
  Rig rig_;
  std::vector<Post> posts_;
  std::vector<BlobFrame> frames_;
};

}  // namespace

std::vector<MultiviewQuality> judge_multiview(const QualitySettings& settings, std::span<const Situation> situations,
                                              const std::function<void(int done)>& progress) {
  Hall hall;
  std::vector<MultiviewQuality> all;
  int done = 0;
  for (const Situation situation : situations) {
    MultiviewQuality quality{situation, 0};
    for (int i = 0; i < settings.clips; ++i) {
      const std::uint64_t seed = clip_seed(settings.seed_base, situation, static_cast<std::size_t>(i));
      if (hall.loses(make_clip(situation, seed), seed)) ++quality.losses;
      progress(++done);
    }
    all.push_back(quality);
  }
  return all;
}

}  // namespace mocap::paper_study
