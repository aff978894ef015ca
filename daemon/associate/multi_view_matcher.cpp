#include "associate/multi_view_matcher.h"

#include <utility>

#include "associate/predicted/predicted_matcher.h"
#include "associate/rays/view_rays.h"
#include "associate/rig_error.h"
#include "associate/unassigned/unassigned_matcher.h"
#include "base/expects.h"

namespace mocap::associate {
namespace {

class ViewMatcher final : public Matcher {
 public:
  ViewMatcher(const MatchSettings& settings, Rig rig)
      : settings_(settings),
        rig_(std::move(rig)),
        rays_(rig_),
        error_(settings_.calibration_px, rig_.size()),
        expected_matcher_(settings_, rig_.size(), error_),
        new_matcher_(settings_, rig_, error_) {}
  ViewMatcher(const ViewMatcher&) = delete;
  ViewMatcher& operator=(const ViewMatcher&) = delete;

  const Matches& match(const FrameSet& frames, const Expected& expected) override {
    matches_.matches.clear();
    matches_.lone.clear();
    matches_.dropped = 0;
    matches_.seen_once = 0;
    matches_.skipped = 0;
    const auto views = static_cast<std::uint32_t>(frames.views.size());
    const std::uint32_t missing = frames.expected_views > views ? frames.expected_views - views : 0;

    rays_.begin(frames);
    expected_matcher_.match(frames, rays_, expected, matches_);
    new_matcher_.match(rays_, missing, matches_);
    expected_matcher_.list_lone(frames, rays_, expected, matches_);

    std::size_t unmatched = 0;
    for (std::size_t view = 0; view < frames.views.size(); ++view) {
      unmatched += frames.views[view]->blobs.size() - rays_[view].size();
      unmatched += rays_[view].free_count();
    }
    matches_.unmatched_blobs = static_cast<std::uint32_t>(unmatched);
    return matches_;
  }

 private:
  MatchSettings settings_;
  Rig rig_;
  RayTable rays_;
  RigError error_;
  ExpectedMatcher expected_matcher_;
  NewMatcher new_matcher_;
  Matches matches_;
};

}  // namespace

std::unique_ptr<Matcher> make_matcher(const MatchSettings& settings, Rig rig) {
  MOCAP_EXPECTS(!rig.empty() && rig.size() <= kMaxCameras);
  return std::make_unique<ViewMatcher>(settings, std::move(rig));
}

}  // namespace mocap::associate
