#include "associate/uncalibrated_views.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "model/calibration/calibrated_camera.h"
#include "support/archived.h"

namespace mocap::associate {
namespace uncalibrated_views_test {

// Remembers the number of blobs of each view.
class BlobCounter : public Matcher {
 public:
  explicit BlobCounter(std::vector<std::size_t>& counts) : counts_(counts) {}
  const Matches& match(const FrameSet& frames, const Predictions& /*predicted*/) override {
    counts_.clear();
    for (const BlobFrame* view : frames.views) counts_.push_back(view->blobs.size());
    return matches_;
  }
  void archive(Archive& members) override { members(counts_); }

 private:
  std::vector<std::size_t>& counts_;
  Matches matches_;
};

Rig rig_with_an_unknown_camera() {
  Rig rig(2);
  rig[0].width_px = rig[0].height_px = 1000;
  rig[0].lens.fx_px = rig[0].lens.fy_px = 800.0;
  rig[1].lens.fx_px = 0.0;
  return rig;
}

TEST(UncalibratedViews, AreMatchedAsIfTheyHadNoBlobs) {
  std::vector<std::size_t> counts;
  const auto matcher = without_uncalibrated_views(std::make_unique<BlobCounter>(counts), rig_with_an_unknown_camera());
  std::vector<BlobFrame> views(2);
  FrameSet frames;
  for (std::uint32_t c = 0; c < 2; ++c) {
    views[c].camera = CameraId{c};
    views[c].blobs.push_back({});
    frames.views.push_back(&views[c]);
  }

  matcher->match(frames, {});

  EXPECT_EQ(counts, (std::vector<std::size_t>{1, 0}));
  EXPECT_EQ(frames.views[1]->blobs.size(), 1u) << "the set itself is unchanged";
}

TEST(UncalibratedViews, HaveAModelThatSeesNothing) {
  const Rig rig = with_blind_models(rig_with_an_unknown_camera());

  EXPECT_EQ(rig[0].lens.fx_px, 800.0);
  EXPECT_TRUE(is_calibrated(rig[1]));
  EXPECT_LT((rig[1].camera_from_world * WorldPoint{}).v.z(), 0.0);
}

TEST(UncalibratedViews, PassOnTheBeliefOfTheMatcher) {
  std::vector<std::size_t> counts{7, 3}, other_counts{0, 0};
  const auto matcher = without_uncalibrated_views(std::make_unique<BlobCounter>(counts), rig_with_an_unknown_camera());
  const auto other =
      without_uncalibrated_views(std::make_unique<BlobCounter>(other_counts), rig_with_an_unknown_camera());

  ASSERT_TRUE(test::take_over(test::archived(*matcher), *other));

  EXPECT_EQ(other_counts, counts);
}

}  // namespace uncalibrated_views_test
}  // namespace mocap::associate
