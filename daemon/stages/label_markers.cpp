#include "stages/label_markers.h"

#include <utility>

#include "base/expects.h"
#include "stages/claim_tracks.h"
#include "stages/label_subject.h"
#include "stages/still_tracks.h"

namespace mocap::stages {
namespace {

class BodyLabeller final : public Labeller {
 public:
  BodyLabeller(const LabelSettings& settings, const std::vector<Subject>& subjects)
      : settings_(settings), still_(settings.still_radius_m), claims_(names_of(subjects)) {
    MOCAP_EXPECTS(subjects.size() <= kMaxSubjects);
    subjects_.reserve(subjects.size());
    for (std::size_t i = 0; i < subjects.size(); ++i) {
      subjects_.emplace_back(settings, subjects[i], SubjectId{static_cast<std::uint32_t>(i)});
    }
    points_.reserve(kMaxMarkers);
    track_of_point_.reserve(kMaxMarkers);
  }

  const Labels& label(const TrackedMarkers& tracked, const Expected& expected) override {
    tracks_.take(tracked);
    still_.update(tracked, expected.at);
    for (SubjectLabeller& subject : subjects_) subject.keep(tracks_, expected.at);
    for (SubjectLabeller& subject : subjects_) {
      if (subject.tracking()) subject.expect(tracks_, expected.at);
    }
    claims_.settle(subjects_, tracks_);
    for (SubjectLabeller& subject : subjects_) {
      if (!subject.tracking()) continue;
      subject.settle(tracks_);
      subject.judge(tracks_, expected.at);
    }
    search(expected.at);
    labels_.resize(subjects_.size());
    for (std::size_t i = 0; i < subjects_.size(); ++i) subjects_[i].show(tracks_, labels_[i]);
    return labels_;
  }

  std::optional<SubjectFit> take_fit() override {
    for (SubjectLabeller& subject : subjects_) {
      if (std::optional<SubjectFit> fit = subject.take_fit()) return fit;
    }
    return std::nullopt;
  }

  void refit(const SubjectFit& fit) override {
    if (fit.subject.value < subjects_.size()) subjects_[fit.subject.value].refit(fit);
  }

 private:
  static std::size_t names_of(const std::vector<Subject>& subjects) {
    std::size_t names = 0;
    for (const Subject& subject : subjects) names += subject.marker_set.markers.size();
    return names;
  }

  // One subject a call at most, so that a search never costs a set more than one of them.
  void search(Timestamp at) {
    if (searched_ && at - *searched_ < settings_.search_every && at >= *searched_) return;
    for (std::size_t i = 0; i < subjects_.size(); ++i) {
      SubjectLabeller& subject = subjects_[(next_ + i) % subjects_.size()];
      if (subject.tracking()) continue;
      searched_ = at;
      next_ = (next_ + i + 1) % subjects_.size();
      gather(subject.rigid() ? Duration{0} : settings_.still_for);
      subject.recognise(points_, track_of_point_, tracks_, at);
      return;
    }
  }

  void gather(Duration still_for) {
    points_.clear();
    track_of_point_.clear();
    for (std::size_t i = 0; i < tracks_.tracked->size(); ++i) {
      const TrackedMarker& track = (*tracks_.tracked)[i];
      const bool there = track.state == TrackState::Confirmed && track.position.v.allFinite();
      if (!there || tracks_.named[i] || still_.rested(i) < still_for) continue;
      points_.push_back(still_for > Duration{0} ? still_.mean(i) : track.position.v);
      track_of_point_.push_back(static_cast<int>(i));
    }
  }

  LabelSettings settings_;
  StillTracks still_;
  std::vector<SubjectLabeller> subjects_;
  TrackClaims claims_;
  NamedTracks tracks_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<int> track_of_point_;
  std::optional<Timestamp> searched_;
  std::size_t next_ = 0;
  Labels labels_;
};

}  // namespace

std::unique_ptr<Labeller> make_labeller(const LabelSettings& settings, std::vector<Subject> subjects) {
  return std::make_unique<BodyLabeller>(settings, subjects);
}

}  // namespace mocap::stages
