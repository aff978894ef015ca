#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "identify/distance_constraints.h"
#include "kinematics/observation.h"
#include "label/distance_constraint_matcher.h"
#include "model/ids.h"
#include "model/skeleton.h"
#include "pose/skeleton_tracker.h"

namespace mocap::label {

/// Which of a few tracks bear the names of one limb, as it was at one instant: the likely readings by the distances
/// that the body keeps, each judged by the pose that it leads to.
///
/// First `clear`, the names, the places, what is allowed, `begin`; then `advance` until it is no longer busy. A reading
/// costs a pose or two, and there may be a hundred: what is found is then of some sets ago.
///
/// Allocates in the constructor only.
class LimbReader {
 public:
  static constexpr int kNowhere = TieReader::kNowhere;

  /// Where a marker of the limb may be.
  struct Place {
    TrackId track;
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    double sigma_m = 0.0;
    bool young = false;  ///< rays may meet there by chance
  };

  LimbReader(const MarkerSet& set, const pose::FollowSettings& follow);

  void clear();
  /// False when there are too many already.
  bool add_name(std::size_t marker);
  bool add_place(const Place& place);
  std::size_t names() const noexcept { return ties_.names(); }
  std::size_t places() const noexcept { return places_.size(); }
  std::size_t marker(std::size_t name) const { return ties_.marker(name); }
  const Place& place(std::size_t place) const { return places_[place]; }

  /// A name may be at a place, against which its ties to the rest of the body say `cost`, half squared sigmas; `hint`,
  /// 0 to 1: how much tells for it that the track bore the name before.
  void allow(std::size_t name, std::size_t place, double cost, double hint);
  /// The name is there now, surely; only a clearly better reading may have it elsewhere.
  void hold(std::size_t name, int place) { now_.place_of[name] = static_cast<std::int8_t>(place); }

  /// From here on the limb is read: of this body, which `others` tell beside the limb; the bones that followed wrong
  /// markers may be turned anyhow.
  void begin(const identify::MarkerTies& ties, const pose::BodyFollower& body, std::span<const kinematics::Observation> others,
             std::span<const char> misread);
  bool busy() const noexcept { return stage_ != Stage::Done; }
  void stop() noexcept { stage_ = Stage::Done; }
  /// Judges `most` readings or fewer, and says how many. `ties` are those of `begin`.
  int advance(const identify::MarkerTies& ties, int most);

  /// Where a clearly better reading than that of now has the names; on which others that are about as good say
  /// otherwise, kNowhere. Null where there is none.
  const TieReader::Reading* found() const noexcept { return found_ ? &best_ : nullptr; }
  int now(std::size_t name) const { return now_.place_of[name]; }
  /// The best reading, clearly better or not.
  const TieReader::Reading& likeliest() const noexcept { return likeliest_; }
  using Shares = std::array<double, TieReader::kMostNames>;
  /// How likely it is of each name, by the readings that are about as good as the best, that a place is its own. All
  /// zero where one of these gives the place to none.
  Shares shares_at(int place) const;

 private:
  enum class Stage { First, Exchange, Challenge, Twins, Done };

  bool propose_more(const identify::MarkerTies& ties);
  bool propose(const TieReader::Reading& reading);
  void propose(std::span<const TieReader::Reading> found);
  void exchange_neighbours(const identify::MarkerTies& ties);
  bool challenge_next(const identify::MarkerTies& ties);
  void challenge(std::size_t name, const identify::MarkerTies& ties);
  void judge(std::size_t reading);
  bool judge_anew(std::size_t reading);
  double put_together(const TieReader::Reading& reading);
  void find_twins(const TieReader::Reading& reading, const TieReader::Reading& best);
  int bone_of(std::size_t name) const { return bone_of_[marker(name)]; }
  const TieReader::Reading& best_judged() const;
  bool doubts(const TieReader::Reading& other, const TieReader::Reading& best, std::size_t name) const;
  double margin(std::size_t name, std::size_t instead) const;
  std::size_t bearer(const TieReader::Reading& reading, int place) const;
  void decide();

  TieReader ties_;
  std::vector<int> bone_of_;  // by marker
  std::vector<Place> places_;
  std::array<std::array<double, TieReader::kMostPlaces>, TieReader::kMostNames> hint_{};
  TieReader::Reading now_;
  pose::BodyFollower body_;
  std::vector<kinematics::Observation> others_;
  std::vector<char> misread_;                 // by bone
  std::vector<char> loose_;                   // by bone, of one reading
  std::vector<kinematics::Observation> tried_;      // markers as a reading has them
  std::vector<TieReader::Reading> readings_;  // the first is that of now
  std::size_t judged_ = 0;                    // of these
  std::size_t most_exchanged_ = 0;            // readings when no more are proposed by exchange
  Stage stage_ = Stage::Done;
  std::size_t next_name_ = 0;                     // to be challenged
  std::size_t next_twin_ = 0;                     // reading to be judged anew
  std::vector<Pose> best_pose_;                   // locals that the best reading led to
  std::vector<pose::BodyFollower::Swing> twins_;  // of one reading: the names that the best has for each other's
  TieReader::Reading best_;                       // when the present stage began; in the end, what is found
  TieReader::Reading likeliest_;
  bool found_ = false;
};

}  // namespace mocap::label
