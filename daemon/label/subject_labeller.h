#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/bounded_vector.h"
#include "geometry/assignment.h"
#include "identify/distance_constraints.h"
#include "label/body_labeller.h"
#include "label/labelled_tracks.h"
#include "label/limb_hypothesis_solver.h"
#include "label/subject_search.h"
#include "model/sighting.h"
#include "model/skeleton.h"
#include "model/subject_state.h"
#include "module/ambiguous_observation.h"
#include "pose/skeleton_tracker.h"

namespace mocap::label {

/// One subject's names. The parts of the labeller call it in the order: keep; expect, claim, let_go and take, settle,
/// judge; or recognise.
///
/// Names follow the body, not the tracks: where the body goes on to tells which track is which marker, all at once, and
/// that a track bore a name before is one more hint. So a track that jumps, or two that exchange their markers, lose
/// their names in the same set, and a marker that comes back has its name as soon as it is clear which it is. Where
/// names are missing while nameless tracks stand near, the whole limb is read anew; so is one that has a name on a
/// track that bore a neighbour's, until that name is there again or the new one was held for long.
class SubjectLabeller {
 public:
  SubjectLabeller(const LabelSettings& settings, const Subject& subject, SubjectId id);

  /// Nobody is known to be anywhere.
  void forget();
  bool tracking() const noexcept { return phase_ == SubjectPhase::Tracking; }
  bool rigid() const noexcept { return set_.skeleton.bones.size() == 1; }
  std::size_t names() const noexcept { return names_.size(); }

  /// Finds the tracks of this set that bear the names.
  void keep(NamedTracks& tracks, Timestamp at);
  /// Moves the body on to `at`, with the names that are where its motion leads to.
  void expect(const NamedTracks& tracks, Timestamp at);
  /// Where a believed name's track is, and where the body's motion puts it.
  struct Stand {
    Eigen::Vector3d at, told;
  };
  std::optional<Stand> place_of(std::size_t marker, const NamedTracks& tracks) const;
  /// A name that may have exchanged its track with another.
  void doubt(std::size_t marker);
  /// Fits the body to the names that are believed.
  void fit(NamedTracks& tracks);
  /// Appends what each name may be given to, rows from `first_row`; nothing where all names are as they should be.
  void claim(const NamedTracks& tracks, std::size_t first_row, std::size_t most,
             std::vector<geometry::AllowedPair>& pairs);
  bool claims() const noexcept { return claims_; }
  /// What the claims leave without its track is free again; `columns` by name.
  void let_go(std::span<const std::uint32_t> columns, NamedTracks& tracks);
  bool bears(std::size_t marker, std::uint32_t track) const { return before_[marker] == static_cast<int>(track); }
  bool jumped(std::size_t marker) const { return jumped_[marker]; }
  void drop(std::size_t marker, NamedTracks& tracks) { free(marker, tracks); }
  /// Whether a track is within the gate of a claim; claims from farther away only contest others.
  bool near(std::size_t marker, std::uint32_t track, const NamedTracks& tracks) const;
  /// Whether another missing name, of the same bone or one next to it, would have the track for less than `below`.
  bool may_be_neighbours(std::size_t marker, std::uint32_t track, double below, const NamedTracks& tracks) const;
  /// Whether the last reading of its limb said that the track is, or may be, another marker.
  bool left_open(std::size_t marker, std::uint32_t track, const NamedTracks& tracks) const;
  void take(std::size_t marker, std::uint32_t track, NamedTracks& tracks);
  /// Takes names back that the body contradicts, reads limbs anew, and learns.
  void settle(NamedTracks& tracks);
  /// Decides whether enough is left to go on.
  void judge(NamedTracks& tracks, Timestamp at);
  /// Takes the names as they were found. False, and nobody tracked, when that tells no pose.
  bool recognise(const Recognised& found, NamedTracks& tracks, Timestamp at);

  const pose::BodyFollower& body() const noexcept { return body_; }
  void show(const NamedTracks& tracks, SubjectLabels& into) const;
  /// Appends what a limb's last reading left open, until it is read again.
  void show_surmised(const NamedTracks& tracks, std::vector<SurmisedMarker>& into) const;
  std::optional<SubjectFit> take_fit();
  /// The body's bones and markers are known better.
  void refit(const SubjectFit& fit);

 private:
  static constexpr double kMarkerSigma_m = 0.004;
  static constexpr float kFreshConfidence = 0.6F;
  static constexpr int kPatience = 2;  // sets until what did not come out is tried again

  struct Share {
    std::uint16_t marker;
    float share;
  };
  struct Name {
    TrackId track;
    int index = NamedTracks::kNone;  // in this instant's tracks
    int doubt = 0;                   // grows while the body contradicts
    float confidence = 0.0F;
    double usual_off_m = 0.003;                         // mean from its place
    bool held = false;                                  // by this track for about 20 sets
    TrackId last;                                       // bore it until it was lost or the name was taken back
    bool leapt = false;                                 // that track did, then or since
    bool unbroken = false;                              // it was seen on and on since
    bool jumped = false;                                // its track is not where its own motion led to
    TrackId surmised;                                   // is likely its own, and may as well be that of another of
    BoundedVector<Share, TieReader::kMostNames> among;  // these markers
    Timestamp surmised_at;
    Timestamp seen_at;  // the rest is of then
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  };
  struct Place {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
    bool known = false;
  };

  void free(std::size_t marker, NamedTracks& tracks);
  void give(std::size_t marker, int index, float confidence, NamedTracks& tracks);
  bool seen(std::size_t marker, const NamedTracks& tracks) const;
  double hint_of(std::size_t marker, int index, const NamedTracks& tracks) const;
  bool stray(std::size_t track, const NamedTracks& tracks) const;
  bool tied(std::size_t marker, const Eigen::Vector3d& at, const NamedTracks& tracks) const;
  kinematics::Observation observe(std::size_t marker, const NamedTracks& tracks) const;
  static double sigma_of(int index, const NamedTracks& tracks);
  void watch(Name& name, const TrackedMarker& track, Timestamp at) const;
  void watch_last(Name& name, const NamedTracks& tracks, Timestamp at) const;
  void hold(std::size_t marker);
  bool missed_by(std::size_t other, TrackId track) const;
  bool missed_by_neighbour(std::size_t marker, TrackId track) const;
  bool contested(std::size_t marker) const;
  void trust(const NamedTracks& tracks, Timestamp at);
  void place();
  Eigen::Matrix3d spread_of(std::size_t marker, const TrackedMarker& track) const;
  // A track farther than that from where a marker is thought to be does not contest its name.
  static constexpr double kContestSigmas = 5.0;
  void consider(std::size_t marker, std::size_t index, const NamedTracks& tracks, geometry::AllowedPair& into,
                double most_sigmas = kContestSigmas) const;
  double most_off(std::size_t marker) const;
  bool vouched(std::size_t marker, double off_m, const NamedTracks& tracks) const;
  void contradict(NamedTracks& tracks);
  void learn(const Recognised& found);

  bool followed_wrongly() const;
  void reread(NamedTracks& tracks);
  void count_trouble(NamedTracks& tracks);
  int most_troubled_bone() const;
  bool begin_limb(const NamedTracks& tracks);
  bool gather_limb(std::size_t seed, const NamedTracks& tracks);
  bool blind(std::size_t bone) const;
  bool add_bone(std::size_t bone);
  void add_places(const NamedTracks& tracks);
  bool too_young(int index, const NamedTracks& tracks) const;
  void allow_places(const NamedTracks& tracks);
  double anchored(std::size_t marker, const Eigen::Vector3d& at, const NamedTracks& tracks) const;
  bool find_read(const TieReader::Reading& found, const NamedTracks& tracks);
  double wanted_below(std::size_t marker, int index, const NamedTracks& tracks) const;
  bool wanted_elsewhere(int index, double below, const NamedTracks& tracks) const;
  bool of_another_limb(TrackId track) const;
  bool taken_elsewhere(int track) const;
  void adopt(NamedTracks& tracks);
  void surmise(const NamedTracks& tracks);
  bool is_surmised(const Name& name) const;

  LabelSettings settings_;
  SubjectId id_;
  MarkerSet set_;
  identify::MarkerTies ties_;
  pose::BodyFollower body_;
  SubjectPhase phase_ = SubjectPhase::Searching;
  Timestamp at_;
  Timestamp enough_at_;
  Timestamp calm_at_;  // when it was last not followed wrongly
  std::vector<Name> names_;
  std::vector<Place> places_;            // where each marker should be
  std::vector<kinematics::Observation> seen_;  // names that are believed in this set
  std::vector<bool> believed_;           // by marker: is in seen_
  std::vector<bool> jumped_;             // by marker: the track that it bore before did
  std::vector<bool> trusted_;            // by marker: the body's motion led to the track that it bore before
  std::vector<int> before_;              // the track of each name before an assignment
  bool claims_ = false;                  // takes part in this set's assignment
  double usual_off_m_ = 0.003;           // mean of the believed names from their places

  LimbReader limb_;
  std::array<TrackId, TieReader::kMostNames> begun_with_;  // by the limb's names: their tracks when it was begun
  std::array<int, TieReader::kMostNames> read_{};          // likewise: as the limb was read
  std::vector<int> strays_;                                // tracks that no believed name bears
  std::vector<int> trouble_;                  // by bone: its names that are missing while strays stand near
  std::vector<int> rest_;                     // by bone: sets until it is read anew again
  std::vector<bool> in_limb_;                 // by bone
  std::vector<char> misread_;                 // by bone: names were taken back, the pose may have followed wrong ones
  std::vector<char> loose_;                   // by bone, of one reading
  std::vector<std::pair<double, int>> near_;  // strays by how far they are from the limb, squared
  std::vector<kinematics::Observation> tried_;      // names that are no part of the limb
  std::optional<SubjectFit> fit_;
};

}  // namespace mocap::label
