#include "label/body_labeller.h"

#include <utility>

#include "base/expects.h"
#include "label/search_reports.h"
#include "label/stationary_tracks.h"
#include "label/subject_labeller.h"
#include "label/subject_search.h"
#include "label/track_association.h"

namespace mocap::label {
namespace {

// Margin of log likelihood by which the identified body must fit better than the body of each other missing subject
// with the same marker set. Chosen by hand; not yet measured.
constexpr double kSubjectMargin = 10.0;

class BodyLabeller final : public Labeller {
 public:
  BodyLabeller(const LabelSettings& settings, const std::vector<Subject>& subjects)
      : settings_(settings),
        stationary_(settings.still_radius_m),
        association_(label_count_of(subjects)),
        reports_(settings.still_for) {
    MOCAP_EXPECTS(subjects.size() <= kMaxSubjects);
    subjects_.reserve(subjects.size());
    searches_.reserve(subjects.size());
    away_.resize(subjects.size());
    for (std::size_t i = 0; i < subjects.size(); ++i) {
      subjects_.emplace_back(settings, subjects[i], SubjectId{static_cast<std::uint32_t>(i)});
      searches_.emplace_back(settings, subjects[i]);
    }
  }

  const Labelling& label(const TrackedMarkers& tracked, const Predictions& expected) override {
    tracks_.update(tracked, expected);
    stationary_.update(tracked, expected.at);
    lose_out_of_sight(expected.at);
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
    labelling_.labels.resize(subjects_.size());
    for (std::size_t i = 0; i < subjects_.size(); ++i) subjects_[i].write_labels(tracks_, labelling_.labels[i]);
    labelling_.ambiguous_observations.clear();
    for (const SubjectLabeller& subject : subjects_) {
      if (subject.tracking()) subject.append_ambiguous_observations(tracks_, labelling_.ambiguous_observations);
    }
    labelling_.fit = take_fit();
    labelling_.search = report_search(expected.at);
    return labelling_;
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

  void adopt(Labeller& before, const Handover& handover) override {
    auto* same = dynamic_cast<BodyLabeller*>(&before);
    if (same == nullptr) return;
    for (std::size_t i = 0; i < subjects_.size() && i < handover.subjects.size(); ++i) {
      const std::size_t from = handover.subjects[i].value;
      if (from >= same->subjects_.size()) continue;
      subjects_[i].adopt(same->subjects_[from]);
      searches_[i].adopt(same->searches_[from]);
      away_[i] = same->away_[from];
      if (!handover.poses) lose(i);
    }
    if (handover.poses) stationary_.adopt(same->stationary_);
    at_ = same->at_;
    step_ = same->step_;
  }

  void archive(Archive& members) override {
    members(stationary_, reports_, away_, next_, at_, step_);
    for (SubjectLabeller& subject : subjects_) members(subject);
    for (SubjectSearch& search : searches_) members(search);
  }

 private:
  void lose_out_of_sight(Timestamp at) {
    for (std::size_t i = 0; i < subjects_.size(); ++i) {
      if (!subjects_[i].tracking() || !subjects_[i].is_out_of_sight(at, step_)) continue;
      searches_[i].learn_joints(subjects_[i].body());
      subjects_[i].lose();
    }
    step_ = at - at_;
    at_ = at;
  }

  // The subject is searched for with its body, in any pose.
  void lose(std::size_t subject) {
    if (subjects_[subject].tracking()) searches_[subject].learn_joints(subjects_[subject].body());
    subjects_[subject].forget();
    searches_[subject].stop();
  }

  const SearchReport* report_search(Timestamp at) {
    for (std::size_t i = 0; i < subjects_.size(); ++i) {
      const SubjectId id{static_cast<std::uint32_t>(i)};
      if (subjects_[i].tracking() || away_[i] != 0) {
        reports_.found(id);
      } else if (reports_.due(id, at)) {
        return &reports_.make(id, searches_[i].has_fitted_body(), tracks_, stationary_, at);
      }
    }
    return nullptr;
  }

  std::optional<SubjectFit> take_fit() {
    for (SubjectLabeller& subject : subjects_) {
      if (std::optional<SubjectFit> fit = subject.take_fit()) return fit;
    }
    return std::nullopt;
  }

  static std::size_t label_count_of(const std::vector<Subject>& subjects) {
    std::size_t label_count = 0;
    for (const Subject& subject : subjects) label_count += subject.marker_set.markers.size();
    return label_count;
  }

  // Searches for one missing subject in a set, so that the time of a set does not grow with the number of subjects.
  void search(Timestamp at) {
    for (std::size_t tried = 0; tried < subjects_.size(); ++tried) {
      if (next_ >= subjects_.size()) next_ = 0;
      if (subjects_[next_].tracking() || away_[next_] != 0) {
        searches_[next_].stop();
        ++next_;
        continue;
      }
      const RecognisedSubject* found = searches_[next_].step(tracks_, stationary_, missing_person_count() < 2, at);
      if (found != nullptr && !is_contested(next_, *found)) recognise(next_, *found, at);
      if (!searches_[next_].busy()) ++next_;
      return;
    }
  }

  std::size_t missing_person_count() const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < subjects_.size(); ++i)
      count += !searches_[i].rigid() && !subjects_[i].tracking() && away_[i] == 0 ? 1 : 0;
    return count;
  }

  void recognise(std::size_t subject_index, const RecognisedSubject& found, Timestamp at) {
    if (!subjects_[subject_index].recognise(found, tracks_, at)) return;
    if (found.is_newly_fitted) searches_[subject_index].refit(found.rest_offsets_m, found.marker_offsets_m);
  }

  // Whether the body of another missing subject fits the identified markers about as well: then no subject is labelled.
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
  SearchReports reports_;
  LabelledTracks tracks_;
  std::vector<SubjectSearch> searches_;  // by subject
  std::vector<char> away_;               // by subject
  std::size_t next_ = 0;                 // subject that is searched for
  Timestamp at_;                         // last set
  Duration step_{};                      // time between the last two sets
  Labelling labelling_;
};

}  // namespace

std::unique_ptr<Labeller> make_labeller(const LabelSettings& settings, std::vector<Subject> subjects) {
  return std::make_unique<BodyLabeller>(settings, subjects);
}

}  // namespace mocap::label
