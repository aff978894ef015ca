#include "explain/search_explainer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/expects.h"
#include "explain/known_sets.h"
#include "explain/search_evidence.h"
#include "explain/standing_view.h"
#include "identify/any_pose_finder.h"

namespace mocap::explain {
namespace {

class Explainer final : public SearchExplainer {
 public:
  Explainer(const ExplainSettings& settings, Rig rig, std::vector<Subject> subjects,
            const std::vector<MarkerSet>& known)
      : settings_(settings), rig_(std::move(rig)), subjects_(std::move(subjects)), known_(known, subjects_, settings) {
    for (const Subject& subject : subjects_) attempts_.emplace_back(subject.marker_set, settings);
  }

  SearchHealth explain(const SearchReport& report, std::span<const CameraSight> cameras) override {
    MOCAP_EXPECTS(report.subject.value < subjects_.size() && cameras.size() == rig_.size());
    std::vector<Eigen::Vector3d> points;
    for (const WorldPoint& point : report.points) points.push_back(point.v);
    SearchEvidence evidence = gather(report, cameras);
    const PoseAttempt best = attempts_[report.subject.value].best(points);
    evidence.facts.explained = best.matched;
    const MarkerSet& own = subjects_[report.subject.value].marker_set;
    if (!best.found || evidence.is_fitted) {
      name_missing(best, evidence.facts);
      evidence.known = known_.nearest(own, best, points, report.confirmed);
    }
    evidence.facts.cause = cause_of(evidence, best.found, best.ambiguous);
    return describe(evidence);
  }

 private:
  SearchEvidence gather(const SearchReport& report, std::span<const CameraSight> cameras) const {
    const Subject& subject = subjects_[report.subject.value];
    SearchEvidence evidence;
    evidence.subject = subject.name;
    evidence.marker_set = subject.marker_set.name;
    for (const MarkerOnBone& marker : subject.marker_set.markers) evidence.marker_names.push_back(marker.name);
    evidence.is_rigid = subject.marker_set.skeleton.bones.size() == 1;
    evidence.is_fitted = report.is_fitted && !evidence.is_rigid;
    evidence.needed = needed(report);
    evidence.views_needed = std::clamp(static_cast<std::uint32_t>(rig_.size()), 2U, settings_.min_views_new);
    evidence.still_for = settings_.still_for;
    evidence.candidates = static_cast<std::uint32_t>(report.points.size()) - report.confirmed;
    evidence.facts.subject = report.subject;
    evidence.facts.points = report.confirmed;
    evidence.facts.still = report.still;
    evidence.facts.markers = static_cast<std::uint32_t>(subject.marker_set.markers.size());
    evidence.standing_in_view = evidence.facts.markers;
    if (!evidence.is_rigid) {
      const std::span<const WorldPoint> markers(report.points.data(), report.confirmed);
      evidence.standing_in_view = standing_markers_in_view(rig_, subject.marker_set, markers, kMinViews);
    }
    for (std::size_t i = 0; i < rig_.size(); ++i) {
      evidence.cameras.push_back({rig_[i].name, false, 0, 0, cameras[i], points_in_view(rig_[i], report)});
    }
    for (const SearchView& view : report.views) {
      CameraEvidence& camera = evidence.cameras[view.camera.value];
      camera.is_in_set = true;
      camera.blobs = view.blobs;
      camera.in_markers = view.in_markers;
    }
    return evidence;
  }

  std::uint32_t needed(const SearchReport& report) const {
    const MarkerSet& set = subjects_[report.subject.value].marker_set;
    if (!report.is_fitted || set.skeleton.bones.size() == 1) return attempts_[report.subject.value].needed();
    const double share = identify::FindAnyPoseSettings{}.min_present_fraction;
    return static_cast<std::uint32_t>(std::ceil(share * static_cast<double>(set.markers.size())));
  }

  void name_missing(const PoseAttempt& best, SearchHealth& facts) const {
    if (best.matched < kMinPoseShare * facts.markers || best.matched < kMinExplainedShare * facts.points) return;
    for (std::uint32_t m = 0; m < best.point_of_marker.size(); ++m) {
      if (best.point_of_marker[m] >= 0) continue;
      facts.missing.push_back({m, best.expected[m], cameras_with_view_of(rig_, best.expected[m])});
    }
  }

  static std::uint32_t points_in_view(const CameraModel& camera, const SearchReport& report) {
    const std::span<const WorldPoint> markers(report.points.data(), report.confirmed);
    return static_cast<std::uint32_t>(
        std::ranges::count_if(markers, [&](const WorldPoint& point) { return in_view(camera, point); }));
  }

  static SearchHealth describe(const SearchEvidence& evidence) {
    SearchHealth health = evidence.facts;
    if (health.cause == SearchCause::WrongMarkerSet) {
      health.known_set = bounded_text<63>(evidence.known->name);
      health.known_set_markers = static_cast<std::uint32_t>(evidence.known->markers);
    }
    health.sentence = bounded_text<511>(sentence_of(evidence));
    return health;
  }

  ExplainSettings settings_;
  Rig rig_;
  std::vector<Subject> subjects_;
  std::vector<PoseAttempts> attempts_;  // by subject
  KnownSets known_;
};

}  // namespace

std::unique_ptr<SearchExplainer> make_search_explainer(const ExplainSettings& settings, Rig rig,
                                                       std::vector<Subject> subjects,
                                                       const std::vector<MarkerSet>& known) {
  return std::make_unique<Explainer>(settings, std::move(rig), std::move(subjects), known);
}

}  // namespace mocap::explain
