#include "lib/benchmark/point_pipeline.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "assemble.h"
#include "geometry/assignment.h"

namespace mocap::benchmark {
namespace {

// Gate of a point at the predicted position of a marker, as MatchSettings has it for blobs.
constexpr double kGateSigmas = 4.0;
constexpr std::size_t kMaxPairs = 16'384;
// A cut ends the track whose position is at most this far from the point.
constexpr double kSamePoint_m = 0.02;
// Ids of the tracks that begin at a cut: above those of the tracker.
constexpr std::uint32_t kFirstCutId = 0x4000'0000;

}  // namespace

/// Matches and markers of one frame: one match without sightings for each point.
class PointPipeline::Points final {
 public:
  Points() : assigner_(kMaxMarkers, kMaxMarkers, kMaxPairs) {}

  void set(const NoisyFrame& frame) { frame_ = &frame; }

  const Matches& match(const Predictions& predicted) {
    matches_.matches.clear();
    for (const NoisyPoint& point : frame_->points) {
      if (!point.position_m.allFinite() || matches_.matches.full()) continue;
      Match& match = matches_.matches.push_back({});
      match.triangulation = Triangulation{{point.position_m}, covariance(), 0.0, 0.0, 0.0};
    }
    associate(predicted);
    return matches_;
  }

  const Markers& triangulate(const Matches& matches) {
    markers_.clear();
    for (std::uint32_t i = 0; i < matches.matches.size(); ++i) {
      const Match& match = matches.matches[i];
      markers_.push_back(
          {match.triangulation->point, match.triangulation->covariance_m2, 0.0, 4, i, match.prediction, false});
    }
    return markers_;
  }

 private:
  static Eigen::Matrix3d covariance() { return kPointSigma_m * kPointSigma_m * Eigen::Matrix3d::Identity(); }

  // Assigns points to all predictions, so that a point of a tracked marker is not taken for another one. Only
  // predictions without a track keep their point: the tracker assigns the others itself.
  void associate(const Predictions& predicted) {
    pairs_.clear();
    for (std::uint32_t p = 0; p < predicted.markers.size(); ++p) {
      const PredictedMarker& marker = predicted.markers[p];
      const Eigen::Matrix3d spread = marker.covariance_m2 + covariance();
      const Eigen::Matrix3d information = spread.inverse();
      for (std::uint32_t i = 0; i < matches_.matches.size() && pairs_.size() < kMaxPairs; ++i) {
        const Eigen::Vector3d off = matches_.matches[i].triangulation->point.v - marker.position.v;
        const double apart = off.dot(information * off);
        if (apart < kGateSigmas * kGateSigmas) pairs_.push_back({p, i, apart});
      }
    }
    const auto columns =
        assigner_.assign(predicted.markers.size(), matches_.matches.size(), pairs_, kGateSigmas * kGateSigmas);
    for (std::uint32_t p = 0; p < predicted.markers.size(); ++p) {
      if (columns[p] == geometry::Assigner::kUnassigned || predicted.markers[p].track.names_something()) continue;
      matches_.matches[columns[p]].prediction = p;
    }
  }

  const NoisyFrame* frame_ = nullptr;
  Matches matches_;
  Markers markers_;
  std::vector<geometry::AllowedPair> pairs_;
  geometry::Assigner assigner_;
};

/// The daemon's tracker, with tracks that end where a frame cuts them: such a track has another id from then on.
class PointPipeline::CutTracker final : public MarkerTracker {
 public:
  explicit CutTracker(std::unique_ptr<MarkerTracker> tracker) : tracker_(std::move(tracker)) {}

  void set(const NoisyFrame& frame) { frame_ = &frame; }

  const PredictedMarkers& predict(Timestamp at) override {
    predictions_ = tracker_->predict(at);
    for (PredictedMarker& marker : predictions_) marker.track = seen_as(marker.track);
    std::ranges::stable_sort(predictions_, {}, [](const PredictedMarker& marker) { return marker.track.value; });
    return predictions_;
  }

  const TrackedMarkers& step(const Markers& markers, const Predictions& predicted,
                             std::span<const BearingOnlyObservation> bearing_only,
                             std::span<const CandidatePoint> candidates) override {
    tracked_ = tracker_->step(markers, predicted, bearing_only, candidates);
    for (const Eigen::Vector3d& cut_m : frame_->cut_m) cut(cut_m);
    for (TrackedMarker& track : tracked_) track.id = seen_as(track.id);
    return tracked_;
  }

  const TrackedMarkers& tracked() const { return tracked_; }

 private:
  TrackId seen_as(TrackId track) const {
    const auto found = ids_.find(track.value);
    return found == ids_.end() ? track : TrackId{found->second};
  }

  void cut(const Eigen::Vector3d& at_m) {
    const TrackedMarker* nearest = nullptr;
    double least_m = kSamePoint_m;
    for (const TrackedMarker& track : tracked_) {
      const double apart_m = (track.position.v - at_m).norm();
      if (track.state == TrackState::Coasting || apart_m >= least_m) continue;
      least_m = apart_m;
      nearest = &track;
    }
    if (nearest != nullptr) ids_[nearest->id.value] = next_id_++;
  }

  std::unique_ptr<MarkerTracker> tracker_;
  const NoisyFrame* frame_ = nullptr;
  std::map<std::uint32_t, std::uint32_t> ids_;  // id of the tracker to the id since its last cut
  std::uint32_t next_id_ = kFirstCutId;
  PredictedMarkers predictions_;
  TrackedMarkers tracked_;
};

/// The daemon's labeller. Remembers what it was given and what it answered.
class PointPipeline::ObservedLabeller final : public Labeller {
 public:
  explicit ObservedLabeller(std::unique_ptr<Labeller> labeller) : labeller_(std::move(labeller)) {}

  const Labelling& label(const TrackedMarkers& tracked, const Predictions& predicted) override {
    predicted_ = &predicted;
    labelling_ = &labeller_->label(tracked, predicted);
    return *labelling_;
  }
  void refit(const SubjectFit& fit) override { labeller_->refit(fit); }

  const Predictions& predicted() const { return *predicted_; }
  const Labelling& labelling() const { return *labelling_; }

 private:
  std::unique_ptr<Labeller> labeller_;
  const Predictions* predicted_ = nullptr;
  const Labelling* labelling_ = nullptr;
};

namespace {

template <class Points>
class PointMatcher final : public Matcher {
 public:
  explicit PointMatcher(Points& points) : points_(points) {}
  const Matches& match(const FrameSet& /*frames*/, const Predictions& predicted) override {
    return points_.match(predicted);
  }

 private:
  Points& points_;
};

template <class Points>
class PointTriangulator final : public Triangulator {
 public:
  explicit PointTriangulator(Points& points) : points_(points) {}
  const Markers& triangulate(const FrameSet& /*frames*/, const Matches& matches) override {
    return points_.triangulate(matches);
  }

 private:
  Points& points_;
};

}  // namespace

PointPipeline::PointPipeline(const settings::DaemonSettings& settings) : points_(std::make_unique<Points>()) {
  fusion::FusionParts parts = assemble_fusion_parts(settings);
  parts.matcher = std::make_unique<PointMatcher<Points>>(*points_);
  parts.triangulator = std::make_unique<PointTriangulator<Points>>(*points_);
  auto tracker = std::make_unique<CutTracker>(std::move(parts.tracker));
  tracker_ = tracker.get();
  parts.tracker = std::move(tracker);
  auto labeller = std::make_unique<ObservedLabeller>(std::move(parts.labeller));
  labeller_ = labeller.get();
  parts.labeller = std::move(labeller);
  parts.drift.reset();
  fusion_ = std::make_unique<fusion::Fusion>(std::move(parts), 1);
}

PointPipeline::~PointPipeline() = default;

const Snapshot& PointPipeline::step(Timestamp at, const NoisyFrame& frame) {
  points_->set(frame);
  tracker_->set(frame);
  FrameSet set;
  set.number = number_++;
  set.exposed_at = at;
  return fusion_->step(set);
}

const Predictions& PointPipeline::predicted() const { return labeller_->predicted(); }
const TrackedMarkers& PointPipeline::tracked() const { return tracker_->tracked(); }
const Labelling& PointPipeline::labelling() const { return labeller_->labelling(); }

}  // namespace mocap::benchmark
