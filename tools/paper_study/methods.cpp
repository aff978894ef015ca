#include "paper_study/methods.h"

#include "paper_study/paper_blob_tracker.h"
#include "track2d/following_blob_tracker.h"

namespace mocap::paper_study {
namespace {

using track2d::TrackMethod;

template <TrackMethod kMethod>
std::unique_ptr<BlobTracker> make_paper(const TrackerNeeds& needs) {
  return paper_study::make_paper_blob_tracker(
      {.method = kMethod, .width_px = needs.width_px, .height_px = needs.height_px, .seed = needs.seed});
}

template <TrackMethod kMethod>
std::unique_ptr<BlobTracker> make_ours(const TrackerNeeds& needs) {
  track2d::TrackBlobsSettings settings;
  settings.method = kMethod;
  settings.seed = needs.seed;
  return track2d::make_blob_tracker(settings, needs.max_blobs);
}

std::unique_ptr<BlobTracker> make_default(const TrackerNeeds& needs) {
  return track2d::make_blob_tracker({}, needs.max_blobs);
}

}  // namespace

std::span<const Method> methods() {
  static const Method kAll[] = {
      {"paper_alpha_beta", true, make_paper<TrackMethod::AlphaBeta>},
      {"paper_kalman", true, make_paper<TrackMethod::Kalman>},
      {"paper_condensation", true, make_paper<TrackMethod::Condensation>},
      {"mocap_alpha_beta", false, make_ours<TrackMethod::AlphaBeta>},
      {"mocap_adaptive_alpha_beta", false, make_ours<TrackMethod::AdaptiveAlphaBeta>},
      {"mocap_adaptive_alpha_beta", false, make_ours<TrackMethod::AdaptiveAlphaBeta>},
      {"mocap_kalman", false, make_ours<TrackMethod::Kalman>},
      {"mocap_condensation", false, make_ours<TrackMethod::Condensation>},
      {"default", false, make_default},
  };
  return kAll;
}

}  // namespace mocap::paper_study
