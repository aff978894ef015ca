#include "associate/multi_view_matcher.h"

#include <utility>

#include "associate/predicted/predicted_matcher.h"
#include "associate/rays/view_rays.h"
#include "associate/rig_error.h"
#include "associate/unassigned/unassigned_matcher.h"
#include "base/expects.h"

namespace mocap::associate {
namespace {

class MultiViewMatcher final : public Matcher {
 public:
  MultiViewMatcher(const MatchSettings& settings, Rig rig)
      : settings_(settings),
        rig_(std::move(rig)),
        rays_(rig_),
        error_(settings_.calibration_px, rig_.size()),
        predicted_matcher_(settings_, rig_.size(), error_),
        unassigned_matcher_(settings_, rig_, error_) {}
  MultiViewMatcher(const MultiViewMatcher&) = delete;
  MultiViewMatcher& operator=(const MultiViewMatcher&) = delete;

  const Matches& match(const FrameSet& frames, const Predictions& predicted) override {
    matches_.matches.clear();
    matches_.bearing_only.clear();
    matches_.candidates.clear();
    matches_.dropped = 0;
    matches_.seen_once = 0;
    matches_.skipped = 0;
    const auto views = static_cast<std::uint32_t>(frames.views.size());
    const std::uint32_t missing = frames.expected_views > views ? frames.expected_views - views : 0;

    rays_.begin(frames);
    predicted_matcher_.match(rays_, predicted, matches_);
    unassigned_matcher_.match(rays_, missing, matches_);
    predicted_matcher_.append_bearing_only(rays_, predicted, matches_);

    std::size_t unmatched = 0;
    for (std::size_t view = 0; view < frames.views.size(); ++view) {
      unmatched += frames.views[view]->blobs.size() - rays_[view].size();
      unmatched += rays_[view].unassigned_count();
    }
    matches_.unmatched_blobs = static_cast<std::uint32_t>(unmatched);
    return matches_;
  }

  void archive(Archive& members) override { members(error_, predicted_matcher_, unassigned_matcher_); }

 private:
  MatchSettings settings_;
  Rig rig_;
  RayTable rays_;
  RigError error_;
  PredictedMatcher predicted_matcher_;
  UnassignedMatcher unassigned_matcher_;
  Matches matches_;
};

}  // namespace

std::unique_ptr<Matcher> make_matcher(const MatchSettings& settings, Rig rig) {
  MOCAP_EXPECTS(!rig.empty() && rig.size() <= kMaxCameras);
  return std::make_unique<MultiViewMatcher>(settings, std::move(rig));
}

}  // namespace mocap::associate
