#pragma once

#include <optional>
#include <span>
#include <vector>

#include "body/find_rigid.h"
#include "body/find_tpose.h"
#include "body/follow_body.h"
#include "body/marker_ties.h"
#include "geometry/assignment.h"
#include "model/sighting.h"
#include "model/skeleton.h"
#include "model/subject_state.h"
#include "stages/label_markers.h"

namespace mocap::stages {

/// The tracks of one instant, and who bears which.
struct NamedTracks {
  static constexpr int kNone = -1;

  const TrackedMarkers* tracked = nullptr;
  std::vector<std::pair<TrackId, int>> by_id;  ///< sorted; index in `tracked`
  std::vector<bool> named;                     ///< by index in `tracked`

  void take(const TrackedMarkers& from);
  int find(TrackId id) const;
};

/// One subject's names. The parts of the labeller call it in the order: keep, read; or recognise.
///
/// Names follow the body, not the tracks: where the body goes on to tells which track is which marker, all at once, and
/// that a track bore a name before is one more hint. So a track that jumps, or two that exchange their markers, lose
/// their names in the same set, and a marker that comes back has its name as soon as it is clear which it is.
class SubjectLabeller {
 public:
  SubjectLabeller(const LabelSettings& settings, const Subject& subject, SubjectId id);

  bool tracking() const noexcept { return phase_ == SubjectPhase::Tracking; }
  bool rigid() const noexcept { return set_.skeleton.bones.size() == 1; }

  /// Finds the tracks of this set that bear the names.
  void keep(NamedTracks& tracks);
  /// Gives each name to the track that the body tells, or to none.
  void read(NamedTracks& tracks, Timestamp at);
  /// Decides whether enough is left to go on.
  void judge(NamedTracks& tracks, Timestamp at);
  /// Looks for the subject among points, of which `track_of_point` are the tracks; names them when it is there.
  bool recognise(std::span<const Eigen::Vector3d> points, std::span<const int> track_of_point, NamedTracks& tracks,
                 Timestamp at);

  void show(const NamedTracks& tracks, SubjectLabels& into) const;
  std::optional<SubjectFit> take_fit();
  /// The body's bones and markers are known better.
  void refit(const SubjectFit& fit);

 private:
  // What a new claim must be better by than any other reading, in squared sigmas.
  static constexpr double kClearMargin = 4.0;
  static constexpr std::size_t kMostReadings = 6;  // that are tried for one track
  static constexpr double kMarkerSigma_m = 0.004;
  static constexpr float kFreshConfidence = 0.6F;

  struct Name {
    TrackId track;
    int index = NamedTracks::kNone;  // in this instant's tracks
    int doubt = 0;                   // grows while the body contradicts
    float confidence = 0.0F;
  };
  struct Place {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
    bool known = false;
  };

  void free(std::size_t marker, NamedTracks& tracks);
  void give(std::size_t marker, int index, float confidence, NamedTracks& tracks);
  bool seen(std::size_t marker, const NamedTracks& tracks) const;
  bool tied(std::size_t marker, const Eigen::Vector3d& at, const NamedTracks& tracks) const;
  body::Observation observe(std::size_t marker, const NamedTracks& tracks) const;
  void trust(const NamedTracks& tracks, Timestamp at);
  void place(Timestamp at);
  void propose(const NamedTracks& tracks, double bonus);
  void consider(std::size_t marker, std::size_t index, const NamedTracks& tracks, double bonus);
  void assign(NamedTracks& tracks);
  bool settled(const geometry::AllowedPair& claim, std::span<const std::uint32_t> columns) const;
  /// Another reading of the markers: a free name gets a track, or gets that of a name which gets another one.
  struct Reading {
    std::size_t name = 0;   // that is free
    std::size_t giver = 0;  // that gives its track to `name` and takes `track`; `name` itself: none
    int track = -1;         // that nobody bears
    double cost = 0.0;
  };

  double most_off() const;
  void reconsider(NamedTracks& tracks);
  void gather_readings(int track, const NamedTracks& tracks);
  bool judge_reading(Reading& reading, const NamedTracks& tracks);
  void adopt(const Reading& reading, NamedTracks& tracks);
  void contradict(NamedTracks& tracks);
  void learn(const body::FoundBody& found);

  LabelSettings settings_;
  SubjectId id_;
  MarkerSet set_;
  body::MarkerTies ties_;
  body::TPoseFinder tpose_;
  body::RigidFinder shape_;
  body::BodyFollower body_;
  geometry::Assigner assigner_;
  SubjectPhase phase_ = SubjectPhase::Searching;
  Timestamp enough_at_;
  std::vector<Name> names_;
  std::vector<Place> places_;                 // where each marker should be
  std::vector<body::Observation> seen_;       // names that are believed in this set
  std::vector<bool> believed_;                // by marker: is in seen_
  std::vector<geometry::AllowedPair> pairs_;  // what each name may be given to
  double usual_off_m_ = 0.003;                // mean of the believed names from their places
  std::vector<Reading> readings_;             // of one track
  std::vector<body::Observation> tried_;      // names as a reading has them
  std::size_t turn_ = 0;                      // whose it is to be reconsidered
  std::vector<int> before_;                   // the track of each name before an assignment
  std::optional<SubjectFit> fit_;
};

}  // namespace mocap::stages
