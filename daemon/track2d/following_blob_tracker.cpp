#include "track2d/following_blob_tracker.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "filter/alpha_beta.h"
#include "filter/condensation.h"
#include "filter/isotropic_kalman.h"
#include "track2d/blob_track_inspection.h"
#include "track2d/blob_tracks.h"

namespace mocap::track2d {
namespace {

using filter::IsotropicKalman;
using filter::Matrix;
using filter::Vector;

// Standard deviations of the state that a filter without a covariance passes to a BlobPair.
constexpr double kVelocitySigma_px_s = 30.0;
constexpr double kPointSigma_px = 0.3;
// Standard deviation added to measurements of the particle filter: with few particles, none is near a precise one.
constexpr double kParticleSighting_px = 1.0;

/// Settings that all filters of one tracker share; they outlive the filters.
struct Shared {
  TrackBlobsSettings settings;
  filter::IsotropicKalmanSettings kalman;
  filter::AlphaBetaSettings alpha_beta;
  filter::CondensationSettings condensation;

  explicit Shared(const TrackBlobsSettings& from) : settings(from) {
    kalman.acceleration_u_s2 = from.acceleration_px_s2;
    kalman.initial_speed_u_s = from.initial_speed_px_s;
    alpha_beta.alpha = from.alpha;
    alpha_beta.beta = from.beta;
    alpha_beta.gate_u = from.method == TrackMethod::AlphaBeta ? from.alpha_beta_gate_px : from.gate_floor_px;
    alpha_beta.gate_per_miss_u = from.gate_floor_px;
    condensation.particles = from.particles;
    condensation.acceleration_u_s2 = from.acceleration_px_s2;
    condensation.initial_speed_u_s = from.initial_speed_px_s;
    condensation.sighting_u = kParticleSighting_px;
    condensation.seed = from.seed;
  }

  IsotropicKalman<2> kalman_of(const Vector<2>& point, const Vector<2>& velocity) const {
    IsotropicKalman<2> made(kalman, point, 0.0);
    made.restart({point, velocity, kPointSigma_px * kPointSigma_px, 0.0, kVelocitySigma_px_s * kVelocitySigma_px_s});
    return made;
  }
};

/// The largest recent speed, with exponential decay. The current speed alone is too small in the image in which a
/// marker reverses.
class RecentSpeed {
 public:
  void advance(double dt_s) {
    if (dt_s != dt_s_) {
      dt_s_ = dt_s;
      decay_ = std::exp2(-dt_s / kHalfLife_s);
    }
    px_s_ *= decay_;
  }
  double dt_s() const { return dt_s_; }  ///< last time step
  void add(double px_s) { px_s_ = std::max(px_s_, px_s); }
  /// The distance in one time step, at `px_s` or at the largest recent speed.
  double step_px(double px_s) const { return std::max(px_s_, px_s) * dt_s_; }

 private:
  static constexpr double kHalfLife_s = 0.2;  // a shaking limb reverses about five times a second

  double px_s_ = 0.0;
  double dt_s_ = 0.0;
  double decay_ = 1.0;
};

/// Radius of a track's gate: `gate_sigmas` times the standard deviation from its covariance, the floor and its speed.
double reach_px(const TrackBlobsSettings& settings, double variance_px2, double step_px) {
  const double wider = settings.gate_floor_px + settings.gate_per_speed * step_px;
  return settings.gate_sigmas * std::sqrt(variance_px2 + wider * wider);
}

class KalmanFollower {
 public:
  KalmanFollower(Shared& shared, const Vector<2>& point, double variance_px2)
      : shared_(&shared), kalman_(shared.kalman, point, variance_px2) {}

  void predict(double dt_s) {
    kalman_.predict(dt_s);
    speed_.advance(dt_s);
  }
  BlobAim aim() const {
    const filter::Motion<2>& motion = kalman_.motion();
    const double hidden_s = kalman_.since_seen_s() - speed_.dt_s();
    return {motion.point, motion.pp,
            reach_px(shared_->settings, motion.pp, speed_.step_px(motion.velocity.norm())) +
                shared_->settings.gate_growth_px_s * std::max(0.0, hidden_s)};
  }
  void update(const Vector<2>& point, double variance_px2) {
    kalman_.update(point, variance_px2);
    speed_.add(kalman_.motion().velocity.norm());
  }
  void coast() { kalman_.coast(); }
  const IsotropicKalman<2>& kalman() const { return kalman_; }
  void restart(const IsotropicKalman<2>& estimate) { kalman_ = estimate; }

 private:
  const Shared* shared_;
  IsotropicKalman<2> kalman_;
  RecentSpeed speed_;
};

class AlphaBetaFollower {
 public:
  AlphaBetaFollower(Shared& shared, const Vector<2>& point, double variance_px2)
      : shared_(&shared), filter_(shared.alpha_beta, {point, Matrix<2>::Identity() * variance_px2}) {}

  void predict(double dt_s) {
    filter_.predict(dt_s);
    speed_.advance(dt_s);
    // The filter has no covariance for the unknown velocity of a new track.
    velocity_uncertainty_px_ =
        measurements_ < 2 ? velocity_uncertainty_px_ + shared_->settings.initial_speed_px_s * dt_s : 0.0;
  }
  BlobAim aim() const {
    const filter::Gate<2> gate = filter_.gate();
    const double variance_px2 = gate.predicted_covariance(0, 0) + velocity_uncertainty_px_ * velocity_uncertainty_px_;
    const bool adaptive = shared_->settings.method == TrackMethod::AdaptiveAlphaBeta;
    const double step_px = adaptive ? speed_.step_px(filter_.belief().velocity.norm()) : 0.0;
    return {gate.centre, variance_px2, reach_px(shared_->settings, variance_px2, step_px)};
  }
  void update(const Vector<2>& point, double variance_px2) {
    filter_.update({point, Matrix<2>::Identity() * variance_px2});
    speed_.add(filter_.belief().velocity.norm());
    ++measurements_;
  }
  void coast() { filter_.coast(); }
  IsotropicKalman<2> kalman() const {
    const filter::Belief<2> belief = filter_.belief();
    return shared_->kalman_of(belief.point, belief.velocity);
  }
  void restart(const IsotropicKalman<2>& estimate) {
    filter_.restart(estimate.motion().point, estimate.motion().velocity);
  }

 private:
  const Shared* shared_;
  filter::AlphaBeta<2> filter_;
  RecentSpeed speed_;
  double velocity_uncertainty_px_ = 0.0;
  std::uint32_t measurements_ = 1;
};

class CondensationFollower {
 public:
  CondensationFollower(Shared& shared, const Vector<2>& point, double variance_px2)
      : shared_(&shared), filter_(with_next_seed(shared.condensation), {point, Matrix<2>::Identity() * variance_px2}) {}

  void predict(double dt_s) {
    filter_.predict(dt_s);
    speed_.advance(dt_s);
  }
  BlobAim aim() const {
    const filter::Belief<2> belief = filter_.belief();
    const double variance_px2 = 0.5 * belief.covariance.trace() + kParticleSighting_px * kParticleSighting_px;
    return {belief.point, variance_px2,
            reach_px(shared_->settings, variance_px2, speed_.step_px(belief.velocity.norm()))};
  }
  void update(const Vector<2>& point, double variance_px2) {
    filter_.update({point, Matrix<2>::Identity() * variance_px2});
    speed_.add(filter_.belief().velocity.norm());
  }
  void coast() { filter_.coast(); }
  IsotropicKalman<2> kalman() const {
    const filter::Belief<2> belief = filter_.belief();
    return shared_->kalman_of(belief.point, belief.velocity);
  }
  void restart(const IsotropicKalman<2>& estimate) {
    const filter::Motion<2>& motion = estimate.motion();
    filter_.restart({motion.point, Matrix<2>::Identity() * motion.pp}, motion.velocity, std::sqrt(motion.vv));
  }

 private:
  /// Gives each track its own random numbers.
  static const filter::CondensationSettings& with_next_seed(filter::CondensationSettings& settings) {
    ++settings.seed;
    return settings;
  }

  const Shared* shared_;
  filter::Condensation<2> filter_;
  RecentSpeed speed_;
};

template <class F>
class FollowingBlobTracker final : public BlobTracker, public BlobTrackInspection {
 public:
  FollowingBlobTracker(const TrackBlobsSettings& settings, std::size_t max_blobs)
      : shared_(settings), tracks_({settings.confirm_images, settings.max_coast}, max_blobs) {}

  void track(BlobFrame& frame) override { track_all(frame.exposed_at, frame.blobs); }

  void track_all(Timestamp at, std::span<Blob> blobs) override {
    tracks_.step(at, blobs,
                 [this](const Vector<2>& point, double variance_px2) { return F(shared_, point, variance_px2); });
    for (Blob& blob : blobs) blob.track = {};
    for (const auto& track : tracks_.tracks()) {
      if (track.confirmed && track.sure && track.blob != tracks_.kNone) blobs[track.blob].track = {track.id};
    }
  }

  void predict_tracks(Timestamp at, std::vector<BlobTrackBelief>& into) const override {
    const double dt_s = to_s(at - tracks_.at());
    for (const auto& track : tracks_.tracks()) {
      F follower = track.follower;
      follower.predict(dt_s);
      const BlobAim aim = follower.aim();
      const bool seen = track.blob != tracks_.kNone;
      const BlobTrackState state = !track.confirmed ? BlobTrackState::Tentative
                                   : seen           ? BlobTrackState::Confirmed
                                                    : BlobTrackState::Coasting;
      into.push_back({{track.id}, track.confirmed, {aim.centre_px}, aim.reach_px, track.blob, state, track.sure});
    }
    for (const auto& lost : tracks_.lost()) {
      into.push_back({{lost.id}, true, {lost.expected_px}, 0.0, tracks_.kNone, BlobTrackState::Lost, false});
    }
  }

 private:
  Shared shared_;
  BlobTracks<F> tracks_;
};

}  // namespace

std::unique_ptr<BlobTracker> make_blob_tracker(const TrackBlobsSettings& settings, std::size_t max_blobs) {
  switch (settings.method) {
    case TrackMethod::AlphaBeta:
    case TrackMethod::AdaptiveAlphaBeta:
      return std::make_unique<FollowingBlobTracker<AlphaBetaFollower>>(settings, max_blobs);
    case TrackMethod::Condensation:
      return std::make_unique<FollowingBlobTracker<CondensationFollower>>(settings, max_blobs);
    case TrackMethod::Kalman: break;
  }
  return std::make_unique<FollowingBlobTracker<KalmanFollower>>(settings, max_blobs);
}

}  // namespace mocap::track2d
