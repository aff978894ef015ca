#include "label/body_labeller.h"

#include <utility>

#include "base/expects.h"
#include "label/stationary_tracks.h"
#include "label/subject_labeller.h"
#include "label/subject_search.h"
#include "label/track_association.h"

namespace mocap::label {
namespace {

// By how much of log-likelihood a body must suit the markers better than another subject's.
constexpr double kSubjectMargin = 10.0;

class BodyLabeller final : public Labeller {
 public:
  BodyLabeller(const LabelSettings& settings, const std::vector<Subject>& subjects)
      : settings_(settings), stationary_(settings.still_radius_m), association_(label_count_of(subjects)) {
    MOCAP_EXPECTS(subjects.size() <= kMaxSubjects);
    subjects_.reserve(subjects.size());
    searches_.reserve(subjects.size());
    away_.resize(subjects.size());
    ambiguous_observations_.reserve(kMaxMarkers);
    for (std::size_t i = 0; i < subjects.size(); ++i) {
      subjects_.emplace_back(settings, subjects[i], SubjectId{static_cast<std::uint32_t>(i)});
      searches_.emplace_back(settings, subjects[i]);
    }
  }

  const Labels& label(const TrackedMarkers& tracked, const Expected& expected) override {
    tracks_.update(tracked);
    stationary_.update(tracked, expected.at);
    for (SubjectLabeller& subject : subjects_) subject.match_tracks(tracks_, expected.at);
    for (SubjectLabeller& subject : subjects_) {
      if (subject.tracking()) subject.predict(tracks_, expected.at);
    }
    association_.associate(subjects_, tracks_);
    for (std::size_t i = 0; i < subjects_.size(); ++i) {
      if (!subjects_[i].tracking()) continue;
      subjects_[i].revise(tracks_);
      subjects_[i].check_loss(tracks_, expected.at);
      if (!subjects_[i].tracking()) searches_[i].learn_joints(subjects_[i].body());
    }
    search(expected.at);
    labels_.resize(subjects_.size());
    for (std::size_t i = 0; i < subjects_.size(); ++i) subjects_[i].write_labels(tracks_, labels_[i]);
    ambiguous_observations_.clear();
    for (const SubjectLabeller& subject : subjects_) {
      if (subject.tracking()) subject.append_ambiguous_observations(tracks_, ambiguous_observations_);
    }
    return labels_;
  }

  std::span<const AmbiguousObservation> ambiguous_observations() const override { return ambiguous_observations_; }

  std::optional<SubjectFit> take_fit() override {
    for (SubjectLabeller& subject : subjects_) {
      if (std::optional<SubjectFit> fit = subject.take_fit()) return fit;
    }
    return std::nullopt;
  }

  void refit(const SubjectFit& fit) override {
    if (fit.subject.value >= subjects_.size()) return;
    subjects_[fit.subject.value].refit(fit);
    searches_[fit.subject.value].refit(fit.rest_offsets_m, fit.marker_offsets_m);
  }

  void reset(SubjectId subject) override {
    if (subject.value >= subjects_.size()) return;
    subjects_[subject.value].forget();
    searches_[subject.value].forget_body();
  }

  void set_away(SubjectId subject, bool away) override {
    if (subject.value >= subjects_.size()) return;
    if (away) subjects_[subject.value].forget();
    searches_[subject.value].stop();
    away_[subject.value] = away ? 1 : 0;
  }

 private:
  static std::size_t label_count_of(const std::vector<Subject>& subjects) {
    std::size_t label_count = 0;
    for (const Subject& subject : subjects) label_count += subject.marker_set.markers.size();
    return label_count;
  }

  // One subject a call at most, so that a search never costs a set more than one of them.
  void search(Timestamp at) {
    for (std::size_t tried = 0; tried < subjects_.size(); ++tried) {
      if (next_ >= subjects_.size()) next_ = 0;
      if (subjects_[next_].tracking() || away_[next_] != 0) {
        searches_[next_].stop();
        ++next_;
        continue;
      }
      const RecognisedSubject* found = searches_[next_].step(tracks_, stationary_, at);
      if (found != nullptr && !is_contested(next_, *found)) recognise(next_, *found, at);
      if (!searches_[next_].busy()) ++next_;
      return;
    }
  }

  void recognise(std::size_t subject_index, const RecognisedSubject& found, Timestamp at) {
    if (!subjects_[subject_index].recognise(found, tracks_, at)) return;
    if (found.is_newly_fitted) searches_[subject_index].refit(found.rest_offsets_m, found.marker_offsets_m);
  }

  // Whether another who is looked for, too, would fit there as well: then nobody is named.
  bool is_contested(std::size_t subject_index, const RecognisedSubject& found) {
    const std::optional<double> own = searches_[subject_index].residual_cost(found, tracks_);
    if (!own) return false;
    for (std::size_t other = 0; other < subjects_.size(); ++other) {
      if (other == subject_index || subjects_[other].tracking() || away_[other] != 0) continue;
      const std::optional<double> cost = searches_[other].residual_cost(found, tracks_);
      if (cost && *cost < *own + kSubjectMargin) return true;
    }
    return false;
  }

  LabelSettings settings_;
  StationaryTracks stationary_;
  std::vector<SubjectLabeller> subjects_;
  TrackAssociation association_;
  LabelledTracks tracks_;
  std::vector<SubjectSearch> searches_;  // by subject
  std::vector<char> away_;               // likewise
  std::size_t next_ = 0;                 // whose turn it is to be looked for
  Labels labels_;
  std::vector<AmbiguousObservation> ambiguous_observations_;
};

}  // namespace

std::unique_ptr<Labeller> make_labeller(const LabelSettings& settings, std::vector<Subject> subjects) {
  return std::make_unique<BodyLabeller>(settings, subjects);
}

}  // namespace mocap::label
