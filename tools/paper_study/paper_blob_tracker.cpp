#include "paper_study/paper_blob_tracker.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "model/bounds.h"
#include "paper_study/paper_alpha_beta.h"
#include "paper_study/paper_condensation.h"
#include "paper_study/paper_kalman.h"

namespace mocap::paper_study {
namespace {

// Every step of the study's filters is one frame, independent of the elapsed time.
constexpr double kFrame = 1.0;

/// `MakeFilter` creates the filter F of a label from its first blob.
template <class F, class MakeFilter>
class PaperBlobTracker final : public BlobTracker, public track2d::BlobTrackInspection {
 public:
  explicit PaperBlobTracker(MakeFilter make_filter) : make_filter_(std::move(make_filter)) {
    labels_.reserve(kMaxBlobs);
  }

  void track(BlobFrame& frame) override { track_all(frame.exposed_at, frame.blobs); }

  void track_all(Timestamp at, std::span<Blob> blobs) override {
    at_ = at;
    for (Blob& blob : blobs) blob.track = {};
    if (labels_.empty()) {
      initialise_labels(blobs);
    } else {
      for (std::uint32_t i = 0; i < labels_.size(); ++i) follow(i, blobs);
    }
  }

  void predict_tracks(Timestamp at, std::vector<track2d::BlobTrackBelief>& into) const override {
    for (std::uint32_t i = 0; i < labels_.size(); ++i) {
      track2d::BlobTrackBelief belief{{i}, true, {labels_[i].filter.belief().point}, 0.0, labels_[i].blob};
      if (at > at_) {
        F filter = labels_[i].filter;
        filter.predict(kFrame);
        belief.point.v = filter.gate().centre;
        belief.gate_radius_px = filter.radius_px();
      }
      into.push_back(belief);
    }
  }

 private:
  struct Label {
    F filter;
    std::uint32_t blob = track2d::BlobTrackBelief::kUnseen;
  };

  static filter::Seen<2> seen(const Blob& blob) {
    return {blob.centroid.v, filter::Matrix<2>::Identity() * blob.sigma_px * blob.sigma_px};
  }

  void initialise_labels(std::span<Blob> blobs) {
    for (std::uint32_t i = 0; i < blobs.size(); ++i) {
      labels_.push_back({make_filter_(seen(blobs[i])), i});
      blobs[i].track = {i};
    }
  }

  void follow(std::uint32_t index, std::span<Blob> blobs) {
    Label& label = labels_[index];
    label.filter.predict(kFrame);
    const filter::Vector<2> centre = label.filter.gate().centre;
    double nearest_px = label.filter.radius_px();
    label.blob = track2d::BlobTrackBelief::kUnseen;
    for (std::uint32_t i = 0; i < blobs.size(); ++i) {
      if (blobs[i].track.names_something()) continue;  // already assigned
      const double distance_px = (blobs[i].centroid.v - centre).norm();
      if (!(distance_px < nearest_px)) continue;
      nearest_px = distance_px;
      label.blob = i;
    }
    if (label.blob == track2d::BlobTrackBelief::kUnseen) {
      label.filter.coast();
    } else {
      label.filter.update(seen(blobs[label.blob]));
      blobs[label.blob].track = {index};
    }
  }

  MakeFilter make_filter_;
  std::vector<Label> labels_;
  Timestamp at_;
};

template <class F, class MakeFilter>
std::unique_ptr<BlobTracker> make(MakeFilter make_filter) {
  return std::make_unique<PaperBlobTracker<F, MakeFilter>>(std::move(make_filter));
}

}  // namespace

std::unique_ptr<BlobTracker> make_paper_blob_tracker(const PaperTrackSettings& settings) {
  const PaperImage image{static_cast<double>(settings.width_px), static_cast<double>(settings.height_px)};
  using Sighting = filter::Seen<2>;
  switch (settings.method) {
    case track2d::TrackMethod::AlphaBeta:
      return make<PaperAlphaBeta>([image](const Sighting& first) { return PaperAlphaBeta(image, first); });
    case track2d::TrackMethod::Kalman:
      return make<PaperKalman>([image](const Sighting& first) { return PaperKalman(image, first); });
    case track2d::TrackMethod::Condensation: {
      const PaperCondensation::Settings condensation{image, settings.seed};
      return make<PaperCondensation>(
          [condensation](const Sighting& first) { return PaperCondensation(condensation, first); });
    }
    default: break;
  }
  MOCAP_EXPECTS(false && "the study has no such method");
  return nullptr;
}

}  // namespace mocap::paper_study
