#include "calibration/rig/repair_rig.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "calibration/rig/refine_rig.h"
#include "calibration/sighting_of.h"
#include "geometry/lens.h"
#include "geometry/triangulation.h"
#include "scene/random.h"
#include "scene/ring_rig.h"

namespace mocap::calibration {
namespace repair_rig_test {

using testing::HasSubstr;
using testing::Not;

CameraModel bumped(CameraModel camera) {
  const Eigen::Vector3d centre = camera.centre().v + Eigen::Vector3d(0.004, -0.003, 0.002);
  camera.camera_from_world.rotation =
      Eigen::AngleAxisd(0.005, Eigen::Vector3d::UnitY()) * camera.camera_from_world.rotation;
  camera.camera_from_world.translation = -(camera.camera_from_world.rotation * centre);
  return camera;
}

struct Volume {
  int markers = 5;
  double extent = 1.0;  ///< 0: all markers of all instants are at one place
};

/// Markers at random positions, observed by true cameras with little noise. The association is known.
class IdealRecording : public MarkerRecording {
 public:
  IdealRecording(Rig truth, int instants, Volume volume = {}) : truth_(std::move(truth)) {
    scene::Random random(4);
    for (int i = 0; i < instants; ++i) {
      auto& set = sets_.emplace_back();
      for (int m = 0; m < volume.markers; ++m) {
        auto& marker = set.emplace_back();
        const Eigen::Vector3d off(2.0 * random.uniform() - 1.0, 2.0 * random.uniform() - 1.0, random.uniform() - 0.5);
        const Eigen::Vector3d at = Eigen::Vector3d(0.0, 0.0, 1.0) + volume.extent * off;
        for (const CameraModel& camera : truth_) {
          Blob blob;
          blob.centroid = *geometry::project(camera, {at});
          blob.centroid.v += 0.05 * Eigen::Vector2d(random.normal(), random.normal());
          marker.push_back(blob);
        }
      }
    }
    for (std::size_t i = 0; i < sets_.size(); ++i) {
      for (std::size_t c = 0; c < truth_.size(); ++c) {
        auto& image = images_[{c, i}];
        for (const auto& marker : sets_[i]) image.push_back(marker[c]);
      }
    }
  }

  void triangulate(const Rig& rig, const std::vector<bool>& excluded,
                   const std::function<void(const TriangulatedSet&)>& visit) const override {
    for (std::size_t i = 0; i < sets_.size(); ++i) {
      TriangulatedSet set{time_of(i), {}};
      for (const auto& blobs : sets_[i]) {
        TriangulatedMarker marker;
        std::vector<geometry::Sighting> rays;
        for (std::uint32_t c = 0; c < rig.size(); ++c) {
          if (!excluded.empty() && excluded[c]) continue;
          rays.push_back(sighting_of(rig[c], *geometry::undistort(rig[c].lens, blobs[c].centroid), 0.1));
          marker.views.push_back({CameraId{c}, blobs[c]});
        }
        marker.position = geometry::refine(rays, *geometry::triangulate(rays))->point;
        set.markers.push_back(marker);
      }
      visit(set);
    }
  }

  std::span<const Blob> blobs(CameraId camera, Timestamp exposed_at) const override {
    return images_.at({camera.value, static_cast<std::size_t>((exposed_at - from_ns(0)).count())});
  }

  std::vector<CameraDeviation> deviations(const Rig& rig) const override {
    std::vector<CameraDeviation> deviations;
    for (std::size_t c = 0; c < rig.size(); ++c) {
      const double moved_m = (rig[c].centre().v - truth_[c].centre().v).norm();
      CameraFromWorld estimate = truth_[c].camera_from_world;  // of a drift watch: better than the rig, not exact
      estimate.translation.x() += 0.01;
      deviations.push_back({moved_m > 1e-3, 1e3 * moved_m, estimate});
    }
    return deviations;
  }

  const Rig& truth() const { return truth_; }

 private:
  static Timestamp time_of(std::size_t set) { return from_ns(static_cast<std::int64_t>(set)); }

  Rig truth_;
  std::vector<std::vector<std::vector<Blob>>> sets_;  // by instant, marker, camera
  std::map<std::pair<std::size_t, std::size_t>, std::vector<Blob>> images_;
};

TEST(RepairRig, RestoresABumpedCamera) {
  for (const int cameras : {4, 6}) {  // with four, leave-one-out validation finds the bumped camera
    const IdealRecording recording(scene::ring_rig({.cameras = cameras}), 60);
    Rig rig = recording.truth();
    rig[1] = bumped(rig[1]);

    const auto repaired = repair_rig(recording, rig, recording.deviations(rig), 1);

    ASSERT_TRUE(repaired) << repaired.error().message;
    ASSERT_EQ(repaired->cameras.size(), 1u);
    EXPECT_EQ(repaired->cameras[0].name, rig[1].name);
    EXPECT_NEAR(repaired->cameras[0].rotated_rad, 0.005, 5e-4);
    for (std::size_t c = 0; c < rig.size(); ++c)
      EXPECT_LT((repaired->rig[c].centre().v - recording.truth()[c].centre().v).norm(), 1e-3) << c;  // m
    EXPECT_LT(repaired->after_px, 0.06);
  }
}

TEST(RepairRig, RefusesABumpedCameraThatSawOnePlaceOnly) {
  const IdealRecording recording(scene::ring_rig({.cameras = 6}), 200, {.markers = 1, .extent = 0.0});
  Rig rig = recording.truth();
  rig[1] = bumped(rig[1]);

  const auto repaired = repair_rig(recording, rig, recording.deviations(rig), 1);

  ASSERT_FALSE(repaired);
  EXPECT_THAT(repaired.error().message, HasSubstr("camera '" + rig[1].name + "' was moved, and its"));
  EXPECT_THAT(repaired.error().message, HasSubstr("expected to 5 mm and 0.1 degrees; move markers through the image"));
}

TEST(RepairRig, RefusesViewsOfOnePlace) {
  const IdealRecording recording(scene::ring_rig({.cameras = 6}), 200, {.markers = 1, .extent = 0.0});

  const auto repaired = repair_rig(recording, recording.truth(), recording.deviations(recording.truth()), 1);

  ASSERT_FALSE(repaired);
  EXPECT_THAT(repaired.error().message, HasSubstr("camera '" + recording.truth()[5].name + "' has 200 views in "));
  EXPECT_THAT(repaired.error().message, HasSubstr("expected at least 100 in 8"));
}

/// The third camera sees markers at the first instants only.
class WithShyCamera final : public IdealRecording {
 public:
  using IdealRecording::IdealRecording;

  void triangulate(const Rig& rig, const std::vector<bool>& excluded,
                   const std::function<void(const TriangulatedSet&)>& visit) const override {
    int instant = 0;
    IdealRecording::triangulate(rig, excluded, [&](TriangulatedSet set) {
      for (TriangulatedMarker& marker : set.markers) {
        std::erase_if(marker.views,
                      [&](const MarkerView& view) { return instant >= 10 && view.camera == CameraId{2}; });
      }
      ++instant;
      visit(set);
    });
  }
};

TEST(RepairRig, KeepsAndNamesACameraWithTooFewViews) {
  const WithShyCamera recording(scene::ring_rig({.cameras = 6}), 60);
  Rig rig = recording.truth();
  scene::Random random(8);
  for (CameraModel& camera : rig)
    camera.camera_from_world.translation += 1e-4 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());

  const auto repaired = repair_rig(recording, rig, recording.deviations(rig), 1);

  ASSERT_TRUE(repaired) << repaired.error().message;
  ASSERT_EQ(repaired->kept.size(), 1U);
  EXPECT_EQ(repaired->kept[0].name, rig[2].name);
  EXPECT_EQ(repaired->kept[0].views, 50U);
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const bool is_same = repaired->rig[c].camera_from_world.translation == rig[c].camera_from_world.translation;
    EXPECT_EQ(is_same, c == 2) << c;
  }
}

TEST(RepairRig, DoesNotAskAKeptCameraForAMotionThatExplainsItsViews) {
  const WithShyCamera recording(scene::ring_rig({.cameras = 6}), 60);
  Rig rig = recording.truth();
  rig[2] = bumped(rig[2]);  // seen only afterwards, as by the motion of the others
  const std::vector<CameraDeviation> undrifted = recording.deviations(recording.truth());

  const auto repaired = repair_rig(recording, rig, undrifted, 1);

  ASSERT_TRUE(repaired) << repaired.error().message;
  ASSERT_EQ(repaired->kept.size(), 1U);
  EXPECT_EQ(repaired->kept[0].name, rig[2].name);
  EXPECT_EQ(repaired->rig[2].camera_from_world.translation, rig[2].camera_from_world.translation);
}

/// The third camera sees all markers in one part of its image. With six cameras, the fourth one sees only the first
/// marker, which only the third and the fifth see, too.
class WithNarrowCamera final : public IdealRecording {
 public:
  using IdealRecording::IdealRecording;

  void triangulate(const Rig& rig, const std::vector<bool>& excluded,
                   const std::function<void(const TriangulatedSet&)>& visit) const override {
    IdealRecording::triangulate(rig, excluded, [&](TriangulatedSet set) {
      for (std::size_t m = 0; m < set.markers.size(); ++m) {
        std::vector<MarkerView>& views = set.markers[m].views;
        for (MarkerView& view : views) {
          if (view.camera == CameraId{2}) view.blob.centroid = {{10.0, 10.0}};
        }
        if (rig.size() < 6) continue;
        std::erase_if(views, [&](const MarkerView& view) {
          const std::uint32_t c = view.camera.value;
          return m == 0 ? c < 2 || c > 4 : c == 2 || c == 3;
        });
      }
      visit(set);
    });
  }
};

TEST(RepairRig, RefusesARigOfThreeByTheCameraThatSeesTooLittle) {
  const WithNarrowCamera recording(scene::ring_rig({.cameras = 3}), 60);
  const Rig& rig = recording.truth();

  const auto repaired = repair_rig(recording, rig, recording.deviations(rig), 1);

  ASSERT_FALSE(repaired);
  const std::string& message = repaired.error().message;
  EXPECT_THAT(message, HasSubstr("camera '" + rig[2].name + "' has 300 views in 1 of the 64 parts of its image"));
  EXPECT_THAT(message, Not(HasSubstr("'" + rig[0].name + "'")));
  EXPECT_THAT(message, Not(HasSubstr("'" + rig[1].name + "'")));
}

TEST(RepairRig, ReportsACameraThatFollowsAnotherOneWithAllItsViews) {
  const WithNarrowCamera recording(scene::ring_rig({.cameras = 6}), 200);
  const Rig& rig = recording.truth();

  const auto repaired = repair_rig(recording, rig, recording.deviations(rig), 1);

  ASSERT_TRUE(repaired) << repaired.error().message;
  ASSERT_EQ(repaired->kept.size(), 2U);
  EXPECT_EQ(repaired->kept[0].name, rig[2].name);
  EXPECT_EQ(reason_of(repaired->kept[0]),
            "its 200 views of markers cover only 1 of 64 parts of its image, expected at least 8");
  EXPECT_EQ(repaired->kept[1].name, rig[3].name);
  EXPECT_TRUE(repaired->kept[1].is_sufficient());
  EXPECT_THAT(reason_of(repaired->kept[1]),
              HasSubstr("too few of its 200 views are of markers that three cameras see"));
}

TEST(RepairRig, NamesNoCameraIfTooFewViewsRemainWithoutAnyOne) {
  const IdealRecording recording(scene::ring_rig({.cameras = 4}), 6);  // 90 views without one camera
  Rig rig = recording.truth();
  rig[1] = bumped(rig[1]);

  const auto repaired = repair_rig(recording, rig, recording.deviations(rig), 1);

  ASSERT_FALSE(repaired);
  EXPECT_THAT(repaired.error().message, HasSubstr("the moved one cannot be found"));
}

TEST(RepairRig, RefusesTooFewMarkers) {
  const IdealRecording recording(scene::ring_rig({.cameras = 6}), 5);

  const auto repaired = repair_rig(recording, recording.truth(), recording.deviations(recording.truth()), 1);

  ASSERT_FALSE(repaired);
  EXPECT_THAT(repaired.error().message, HasSubstr("25 markers that three cameras or more see, expected at least 50"));
}

TEST(RepairRig, RefusesARigWithTooManyBumpedCameras) {
  const IdealRecording recording(scene::ring_rig({.cameras = 4}), 30);
  Rig rig = recording.truth();
  std::vector<CameraDeviation> deviations = recording.deviations(rig);
  for (CameraDeviation& deviation : deviations) deviation.drifted = true;
  for (CameraModel& camera : rig) camera = bumped(bumped(bumped(camera)));

  const auto repaired = repair_rig(recording, rig, deviations, 1);

  EXPECT_FALSE(repaired);
}

TEST(RefineRig, ReducesTheResidualOfPerturbedCameras) {
  const IdealRecording recording(scene::ring_rig({.cameras = 5}), 40);
  Rig rig = recording.truth();
  scene::Random random(8);
  for (CameraModel& camera : rig)
    camera.camera_from_world.translation += 1e-3 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  std::vector<ObservedMarker> markers;
  recording.triangulate(rig, {}, [&](const TriangulatedSet& set) {
    for (const TriangulatedMarker& marker : set.markers) {
      ObservedMarker& observed = markers.emplace_back();
      observed.point = marker.position;
      for (const MarkerView& view : marker.views)
        observed.observations.push_back({static_cast<int>(view.camera.value), view.blob.centroid, 0.05});
    }
  });

  const auto refined = refine_rig(rig, markers, {.threads = 1});

  ASSERT_TRUE(refined);
  EXPECT_GT(refined->before_px, 0.15);
  EXPECT_NEAR(refined->after_px, 0.05, 0.02);  // the noise, less the degrees of freedom
}

}  // namespace repair_rig_test
}  // namespace mocap::calibration
