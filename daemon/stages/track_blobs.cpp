#include "stages/track_blobs.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "filter/alpha_beta.h"
#include "filter/condensation.h"
#include "filter/kalman.h"
#include "model/bounds.h"
#include "stages/inspect_blob_tracks.h"
#include "stages/point_tracks.h"

namespace mocap::stages {
namespace {

// Blobs of unknown markers to reckon with: some thirty in a 640x480 image.
constexpr double kNewBlobs_1_px2 = 1e-4;
// A track may live on while another takes its blob: twice as many tracks as blobs.
constexpr std::size_t kMaxTracks = 2 * kMaxBlobs;
// A blob knows its place no better, whatever its image says: calibration, shape, motion.
constexpr double kMinSigma_px = 0.02;

/// `Birth` makes the filter F of a new track from its first sighting.
template <class F, class Birth>
class FilteringBlobTracker final : public BlobTracker, public BlobTrackInspection {
 public:
  FilteringBlobTracker(const TrackLife& life, Birth birth)
      : gate_sigmas_(life.gate_sigmas), birth_(std::move(birth)), tracks_(life, kMaxTracks, kMaxBlobs) {
    seen_.reserve(kMaxBlobs);
  }

  void track(BlobFrame& frame) override {
    seen_.clear();
    for (const Blob& blob : frame.blobs) {
      const double sigma = std::max(blob.sigma_px, kMinSigma_px);
      seen_.push_back({blob.centroid.v, filter::Matrix<2>::Identity() * sigma * sigma});
    }
    tracks_.advance(frame.exposed_at, seen_.size());
    for (std::uint32_t i = 0; i < seen_.size(); ++i) {
      if (!seen_[i].point.allFinite() || !seen_[i].covariance.allFinite()) tracks_.ignore(i);
      frame.blobs[i].track = {};
    }
    tracks_.assign(seen_);
    tracks_.settle(seen_, birth_);
    for (const auto& track : tracks_.tracks()) {
      if (track.confirmed && track.sighting != tracks_.kNone) frame.blobs[track.sighting].track = {track.id};
    }
  }

  void look_ahead(Timestamp at, std::vector<BlobTrackBelief>& into) const override {
    for (const auto& track : tracks_.tracks()) {
      F filter = track.filter;
      filter.predict(to_s(at - tracks_.at()));
      const filter::Gate<2> gate = filter.gate();
      const double sigma_px = std::pow(gate.covariance.determinant(), 0.25);
      into.push_back({{track.id}, track.confirmed, {gate.centre}, gate_sigmas_ * sigma_px, track.sighting});
    }
  }

 private:
  double gate_sigmas_;
  Birth birth_;
  PointTracks<F, 2> tracks_;
  std::vector<filter::Seen<2>> seen_;
};

template <class F, class Birth>
std::unique_ptr<BlobTracker> make(const TrackLife& life, Birth birth) {
  return std::make_unique<FilteringBlobTracker<F, Birth>>(life, std::move(birth));
}

filter::KalmanSettings kalman_settings(const TrackBlobsSettings& settings) {
  filter::KalmanSettings kalman;
  kalman.acceleration_u_s2 = settings.acceleration_px_s2;
  kalman.acceleration_per_speed = settings.acceleration_per_speed_1_s;
  kalman.birth_speed_u_s = settings.birth_speed_px_s;
  kalman.gate_floor_u = settings.gate_floor_px;
  kalman.gate_per_speed = settings.gate_per_speed;
  kalman.max_agility = 25.0;
  return kalman;
}

}  // namespace

std::unique_ptr<BlobTracker> make_blob_tracker(const TrackBlobsSettings& settings) {
  const TrackLife life{settings.gate_sigmas, settings.confirm_images, settings.max_coast, kNewBlobs_1_px2};
  using Sighting = filter::Seen<2>;
  switch (settings.method) {
    case TrackMethod::AlphaBeta: {
      filter::AlphaBetaSettings alpha_beta;
      alpha_beta.alpha = settings.alpha;
      alpha_beta.beta = settings.beta;
      // No covariance tells this filter that a new track's speed is unknown: the floor must bear it.
      alpha_beta.gate_u = 2.0 * settings.gate_floor_px;
      alpha_beta.gate_per_speed = settings.gate_per_speed;
      alpha_beta.gate_per_miss_u = settings.gate_floor_px;
      return make<filter::AlphaBeta<2>>(
          life, [alpha_beta](const Sighting& seen) { return filter::AlphaBeta<2>(alpha_beta, seen); });
    }
    case TrackMethod::Condensation: {
      filter::CondensationSettings condensation;
      condensation.particles = settings.particles;
      condensation.acceleration_u_s2 = settings.acceleration_px_s2;
      condensation.birth_speed_u_s = settings.birth_speed_px_s;
      condensation.sighting_u = 1.0;
      condensation.gate_floor_u = settings.gate_floor_px;
      condensation.seed = settings.seed;
      return make<filter::Condensation<2>>(life, [condensation](const Sighting& seen) mutable {
        ++condensation.seed;  // each track its own numbers
        return filter::Condensation<2>(condensation, seen);
      });
    }
    case TrackMethod::Kalman: break;
  }
  return make<filter::Kalman<2>>(
      life, [kalman = kalman_settings(settings)](const Sighting& seen) { return filter::Kalman<2>(kalman, seen); });
}

}  // namespace mocap::stages
