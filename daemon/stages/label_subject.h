#pragma once

#include <optional>
#include <span>
#include <vector>

#include "body/find_rigid.h"
#include "body/find_tpose.h"
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

/// One subject's names. The parts of the labeller call it in the order: keep, take_back, claim; or recognise.
class SubjectLabeller {
 public:
  SubjectLabeller(const LabelSettings& settings, const Subject& subject, SubjectId id);

  bool tracking() const noexcept { return phase_ == SubjectPhase::Tracking; }
  bool rigid() const noexcept { return set_.skeleton.bones.size() == 1; }

  /// Names whose tracks live stay.
  void keep(NamedTracks& tracks);
  /// Names that the distances along the body contradict are free again.
  void take_back(NamedTracks& tracks);
  /// Free names go to unnamed tracks.
  void claim(NamedTracks& tracks, const Expected& expected);
  /// Decides whether enough is left to go on.
  void judge(NamedTracks& tracks, Timestamp at);
  /// Looks for the subject among points, of which `track_of_point` are the tracks; names them when it is there.
  bool recognise(std::span<const Eigen::Vector3d> points, std::span<const int> track_of_point, NamedTracks& tracks,
                 Timestamp at);

  void show(const NamedTracks& tracks, SubjectLabels& into) const;
  std::optional<SubjectFit> take_fit();

 private:
  struct Name {
    TrackId track;
    int index = NamedTracks::kNone;  // in this instant's tracks
    int doubt = 0;                   // grows while distances contradict
    float confidence = 0.0F;
  };
  struct Agreement {
    int kept = 0;    // rigid ties that hold
    int broken = 0;  // ties that do not
    bool badly = false;
  };

  void free(std::size_t marker, NamedTracks& tracks);
  void give(std::size_t marker, int index, float confidence, NamedTracks& tracks);
  bool seen(std::size_t marker, const NamedTracks& tracks) const;
  Agreement agreement(std::size_t marker, const Eigen::Vector3d& at, const NamedTracks& tracks) const;
  void gather_claims(const NamedTracks& tracks, const Expected& expected);
  void consider(std::size_t marker, const ExpectedMarker& expected, int index, const NamedTracks& tracks);
  bool settled(std::uint32_t marker, std::uint32_t index, double cost) const;
  void learn(const body::FoundBody& found);

  LabelSettings settings_;
  SubjectId id_;
  MarkerSet set_;
  body::MarkerTies ties_;
  body::TPoseFinder tpose_;
  body::RigidFinder shape_;
  geometry::Assigner assigner_;
  SubjectPhase phase_ = SubjectPhase::Searching;
  Timestamp enough_at_;
  std::vector<Name> names_;
  std::vector<geometry::AllowedPair> claims_;
  std::optional<SubjectFit> fit_;
};

}  // namespace mocap::stages
