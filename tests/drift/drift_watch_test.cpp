#include "drift/drift_watch.h"

#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <set>

#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "geometry/lens.h"
#include "scene/random.h"
#include "support/bumped_camera.h"
#include "track3d/kalman_marker_tracker.h"

namespace mocap::drift {
namespace drift_watch_test {

using test::bumped;
using test::eight_cameras;

constexpr double kDegree = std::numbers::pi / 180.0;

/// The pipeline from blobs to 3D tracks with a drift watch. The pipeline uses the rig of the file; the blobs are
/// projections into the cameras of `truth`.
class Capture {
 public:
  Capture(Rig file, std::uint64_t seed) : file_(std::move(file)), truth_(file_), random_(seed), watch_({}, file_) {
    matcher_ = associate::make_matcher({}, file_);
    triangulator_ = associate::make_triangulator({}, file_);
    tracker_ = track3d::make_marker_tracker({});
    views_.resize(file_.size());
  }

  void set_truth(Rig truth) { truth_ = std::move(truth); }
  void remove_markers() { markers_ = 0; }

  void run(double seconds) {
    for (int i = 0; i < static_cast<int>(seconds * kRate_hz); ++i) step();
  }

  const CameraDrift& camera(std::uint32_t c) const { return watch_.camera(CameraId{c}); }
  double t_s() const { return t_s_; }

 private:
  static constexpr double kRate_hz = 60.0;

  void step() {
    t_s_ += 1.0 / kRate_hz;
    FrameSet frames;
    frames.exposed_at = from_ns(0) + from_s(t_s_);
    frames.expected_views = static_cast<std::uint32_t>(file_.size());
    for (std::uint32_t c = 0; c < views_.size(); ++c) {
      see(c);
      views_[c].exposed_at = frames.exposed_at;
      frames.views.push_back(&views_[c]);
    }
    predicted_->at = frames.exposed_at;
    predicted_->markers = tracker_->predict(frames.exposed_at);
    const Matches& matches = matcher_->match(frames, *predicted_);
    const Markers& markers = triangulator_->triangulate(frames, matches);
    watch_.update(frames, matches, markers);
    (void)tracker_->step(markers, *predicted_, matches.bearing_only);
  }

  // Twenty markers move through the volume. One view in five is missing, and each image has three clutter blobs.
  void see(std::uint32_t c) {
    BlobFrame& view = views_[c];
    view.camera = CameraId{c};
    view.blobs.clear();
    for (int m = 0; m < markers_; ++m) {
      const double phase = 1.7 * m;
      const Eigen::Vector3d at(1.2 * std::sin(0.5 * t_s_ + phase), 1.2 * std::cos(0.37 * t_s_ + 2.3 * phase),
                               1.0 + 0.7 * std::sin(0.61 * t_s_ + 0.9 * phase));
      const auto seen = geometry::project(truth_[c], {at});
      if (!seen || !geometry::in_image(truth_[c], *seen) || random_.uniform() < 0.2) continue;
      add(view, seen->v + 0.1 * Eigen::Vector2d(random_.normal(), random_.normal()));
    }
    for (int i = 0; i < 3; ++i)
      add(view, {truth_[c].width_px * random_.uniform(), truth_[c].height_px * random_.uniform()});
  }

  static void add(BlobFrame& view, const Eigen::Vector2d& at) {
    Blob blob;
    blob.centroid.v = at;
    view.blobs.push_back(blob);
  }

  Rig file_, truth_;
  scene::Random random_;
  DriftWatch watch_;
  std::unique_ptr<Matcher> matcher_;
  std::unique_ptr<Triangulator> triangulator_;
  std::unique_ptr<MarkerTracker> tracker_;
  std::vector<BlobFrame> views_;
  std::unique_ptr<Predictions> predicted_ = std::make_unique<Predictions>();
  double t_s_ = 0.0;
  int markers_ = 20;
};

TEST(DriftWatch, ReportsABumpedCameraWithinTenSecondsAndNoOther) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Rig file = eight_cameras();
    Capture capture(file, seed);
    capture.run(3.0);
    Rig truth = file;
    const auto c = static_cast<std::uint32_t>(2 * seed);
    truth[c] = bumped(truth[c], 0.3 * kDegree, 0.005);
    capture.set_truth(truth);

    capture.run(10.0);

    for (std::uint32_t i = 0; i < file.size(); ++i) EXPECT_EQ(capture.camera(i).drifted, i == c) << "camera " << i;
    // At 4.5 m a rotation of 0.05 degrees and a translation of 4 mm move the image by about the same.
    EXPECT_NEAR(capture.camera(c).turned_rad / kDegree, 0.3, 0.05);
    EXPECT_NEAR(capture.camera(c).moved_m, 0.005, 0.004);
  }
}

// With a low resolution the bump (2.6 px) stays within the gates of the matcher and biases the markers.
TEST(DriftWatch, ReportsOnlyTheBumpedOneOfFourCameras) {
  for (std::uint64_t seed = 11; seed <= 14; ++seed) {
    const Rig file = scene::ring_rig(
        {.cameras = 4, .radius_m = 4.5, .height_m = 2.4, .width_px = 640, .height_px = 480, .hfov_rad = 1.13});
    Capture capture(file, seed);
    capture.run(3.0);
    Rig truth = file;
    const auto c = static_cast<std::uint32_t>(seed - 11);
    truth[c] = bumped(truth[c], 0.3 * kDegree, 0.005);
    capture.set_truth(truth);
    std::set<std::uint32_t> reported;

    for (int second = 0; second < 20; ++second) {
      capture.run(1.0);
      for (std::uint32_t i = 0; i < file.size(); ++i) {
        if (capture.camera(i).drifted) reported.insert(i);
      }
      if (second == 9) {
        EXPECT_TRUE(reported.contains(c)) << "camera " << c;
      }
    }

    EXPECT_EQ(reported, std::set<std::uint32_t>{c});
  }
}

TEST(DriftWatch, ReportsNoDriftIfTheRigIsCorrect) {
  Capture capture(eight_cameras(), 5);

  capture.run(20.0);

  for (std::uint32_t i = 0; i < 8; ++i) {
    EXPECT_FALSE(capture.camera(i).drifted);
    EXPECT_LT(capture.camera(i).off_px, 0.1);
    EXPECT_GT(capture.camera(i).views, 100.0);
  }
}

TEST(DriftWatch, ClearsTheReportOfACameraThatIsBackInPlace) {
  const Rig file = eight_cameras();
  Capture capture(file, 6);
  Rig truth = file;
  truth[1] = bumped(truth[1], 0.3 * kDegree, 0.0);
  capture.set_truth(truth);
  capture.run(10.0);
  ASSERT_TRUE(capture.camera(1).drifted);
  capture.set_truth(file);

  capture.run(20.0);

  EXPECT_FALSE(capture.camera(1).drifted);
}

TEST(DriftWatch, KeepsTheFiguresOfADriftedCameraWhileNoMarkersAreThere) {
  const Rig file = eight_cameras();
  Capture capture(file, 8);
  Rig truth = file;
  truth[1] = bumped(truth[1], 0.3 * kDegree, 0.0);
  capture.set_truth(truth);
  capture.run(10.0);
  ASSERT_TRUE(capture.camera(1).drifted);
  const double off_px = capture.camera(1).off_px;

  capture.remove_markers();
  capture.run(60.0);

  EXPECT_TRUE(capture.camera(1).drifted);
  EXPECT_LT(capture.camera(1).views, 1.0);
  EXPECT_NEAR(capture.camera(1).off_px, off_px, 0.5 * off_px);
  EXPECT_NEAR(capture.camera(1).turned_rad / kDegree, 0.3, 0.15);
  EXPECT_EQ(capture.camera(2).off_px, 0.0);
}

TEST(DriftWatch, MeasuresASmallDriftBeforeTheMatcherLosesTheCamera) {
  const Rig file = eight_cameras();
  Capture capture(file, 7);
  Rig truth = file;
  truth[4] = bumped(truth[4], 0.06 * kDegree, 0.0);  // 1.1 px
  capture.set_truth(truth);

  capture.run(15.0);

  EXPECT_NEAR(capture.camera(4).off_px, 1.1, 0.15);
  EXPECT_GT(capture.camera(4).rms_px, capture.camera(4).off_px);  // both are lengths: the noise comes on top
  EXPECT_NEAR(capture.camera(4).rms_px, capture.camera(4).off_px, 0.15);
  EXPECT_NEAR(capture.camera(4).turned_rad / kDegree, 0.06, 0.05);  // a translation of 4 mm has about the same effect
  for (std::uint32_t i = 0; i < file.size(); ++i) {
    if (i == 4) continue;
    EXPECT_FALSE(capture.camera(i).drifted) << "camera " << i;
  }
}

}  // namespace drift_watch_test
}  // namespace mocap::drift
