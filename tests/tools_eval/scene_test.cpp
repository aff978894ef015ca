#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "detect/blob_detector.h"
#include "eval/scene_run.h"
#include "lib/simworld/recognition.h"
#include "lib/simworld/scene_blobs.h"
#include "lib/simworld/scene_world.h"
#include "scene/render.h"
#include "settings/subject/marker_set_file.h"
#include "support/places.h"
#include "support/sanitized.h"

namespace mocap::eval {
namespace scene_test {

constexpr int kWidth_px = 480, kHeight_px = 400;

// Mean figures of the detector or of BlobMaker for discs of one radius.
struct BlobFigures {
  double error_px = 0.0, sigma_px = 0.0, area_px2 = 0.0;
};

std::vector<simworld::Spot> scattered(double radius_px, scene::Random& random) {
  std::vector<simworld::Spot> spots;
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 10; ++x) {
      const double dx = random.uniform();
      spots.push_back({{25.0 + 46.0 * x + dx, 25.0 + 46.0 * y + random.uniform()}, radius_px, 0});
    }
  }
  return spots;
}

void add(const std::vector<simworld::Spot>& spots, const Blobs& blobs, BlobFigures& sum, int& count) {
  for (const simworld::Spot& spot : spots) {
    for (const Blob& blob : blobs) {
      const double squared = (blob.centroid.v - spot.centre_px).squaredNorm();
      if (squared > 1.0) continue;
      sum.error_px += 0.5 * squared;
      sum.sigma_px += blob.sigma_px;
      sum.area_px2 += blob.area_px2;
      ++count;
    }
  }
}

Blobs detect(const std::vector<simworld::Spot>& spots, std::uint64_t number) {
  scene::Renderer renderer(kWidth_px, kHeight_px, {}, 0);
  const auto detector = detect::make_blob_detector({}, PixelFormat::Mono8, kWidth_px, kHeight_px);
  std::vector<std::byte> pixels(static_cast<std::size_t>(kWidth_px) * kHeight_px);
  std::vector<scene::Disc> discs;
  for (const simworld::Spot& spot : spots) discs.push_back({spot.centre_px, spot.centre_px, spot.radius_px, 1.0});
  renderer.render(discs, number, pixels);
  return (*detector)->detect({pixels, kWidth_px, kWidth_px, kHeight_px, PixelFormat::Mono8}).blobs;
}

BlobFigures figures_of(double radius_px, bool rendered) {
  scene::Random random(11);
  simworld::BlobMaker maker(1.0);
  BlobFigures sum;
  int count = 0;
  for (std::uint64_t image = 0; image < 6; ++image) {
    const std::vector<simworld::Spot> spots = scattered(radius_px, random);
    Blobs blobs;
    if (rendered) {
      blobs = detect(spots, image);
    } else {
      maker.see(spots, random, blobs);
    }
    add(spots, blobs, sum, count);
  }
  EXPECT_EQ(count, 480);
  return {std::sqrt(sum.error_px / count), sum.sigma_px / count, sum.area_px2 / count};
}

TEST(BlobMaker, AgreesWithTheDetectorInErrorSigmaAndArea) {
  for (const double radius_px : {1.5, 2.0, 3.0, 5.0}) {
    const BlobFigures real = figures_of(radius_px, true), made = figures_of(radius_px, false);

    // 960 samples: standard deviation 2.3 %. The model itself is within 10 %.
    EXPECT_NEAR(made.error_px / real.error_px, 1.0, 0.15) << radius_px;
    EXPECT_NEAR(made.sigma_px / real.sigma_px, 1.0, 0.15) << radius_px;
    EXPECT_NEAR(made.area_px2 / real.area_px2, 1.0, 0.07) << radius_px;
  }
}

TEST(BlobMaker, MergesDiscsAtTheSameDistanceAsTheDetector) {
  simworld::BlobMaker maker(1.0);
  scene::Random random(5);
  for (const double radius_px : {1.5, 2.0, 3.0}) {
    for (const double over_px : {-0.5, 0.5}) {  // relative to the distance at which one blob becomes two
      const double apart_px = 1.25 * radius_px + 1.4 + over_px;
      const std::vector<simworld::Spot> spots{{{100.2, 100.4}, radius_px, 0},
                                              {{100.2 + apart_px, 100.4}, radius_px, 1}};
      Blobs made;
      maker.see(spots, random, made);

      EXPECT_EQ(made.size(), detect(spots, 1).size()) << radius_px << " " << over_px;
    }
  }
}

simworld::SceneFile walker() {
  simworld::SceneFile scene;
  scene.seconds = 6.0;
  scene.ring = {.cameras = 8, .radius_m = 4.0, .height_m = 2.5, .width_px = 1280, .height_px = 1024};
  simworld::SceneActor& actor = scene.actors.emplace_back();
  actor.name = "walker";
  actor.motion = "tpose:2,walk";
  actor.marker_set = support::source_folder() + "/config/markersets/baseline41.toml";
  return scene;
}

TEST(Scene, LabelsAndSolvesAWalk) {
  const auto outcome = run_scene(walker(), "", {});

  ASSERT_TRUE(outcome) << outcome.error().message;
  const scoring::LabelCounts& names = outcome->labels.at(0);
  EXPECT_GT(*names.f1(), 0.99);
  EXPECT_GT(*names.availability(), 0.99);
  EXPECT_LT(names.first_label_s.at(0), 1.5);
  EXPECT_LT(*outcome->bones.at(0).joint_rms_mm(), 20.0);
  EXPECT_EQ(outcome->sets, 720U);
}

// With three cameras the body hides many markers from all but two of them.
TEST(Scene, FindsATPoseWithThreeCamerasByDefault) {
  simworld::SceneFile scene = walker();
  scene.ring.cameras = 3;
  scene.actors[0].heading_deg = 45.0;

  const auto outcome = run_scene(scene, "", {});

  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_GT(outcome->labels.at(0).f1().value_or(0.0), 0.97);
  EXPECT_EQ(outcome->ghosts, 0U);
}

// The arms of the T-pose are parallel to the line between the cameras: their blobs share an epipolar line.
TEST(Scene, FindsATPoseWithTwoCamerasByDefault) {
  simworld::SceneFile scene = walker();
  scene.rig_file = support::source_folder() + "/config/two_cameras.rig.toml";
  scene.actors[0].marker_set = support::source_folder() + "/config/markersets/openmocap18.toml";

  const auto outcome = run_scene(scene, "", {});

  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_GT(outcome->labels.at(0).f1().value_or(0.0), 0.97);
}

TEST(Scene, IsTheSameForTheSameSeed) {
  simworld::SceneFile scene = walker();
  scene.seconds = 2.0;
  scene.hides.push_back({.from_s = 1.0});

  const auto first = run_scene(scene, "", {.seed = 4}), again = run_scene(scene, "", {.seed = 4}),
             other = run_scene(scene, "", {.seed = 5});

  EXPECT_EQ(first->labels.at(0).squares_m2, again->labels.at(0).squares_m2);
  EXPECT_NE(first->labels.at(0).squares_m2, other->labels.at(0).squares_m2);
}

struct World {
  World(const simworld::SceneFile& scene, bool rays) {
    auto performers = simworld::make_performers(scene, "", 1);
    Rig rig = scene::ring_rig(scene.ring);
    auto events = simworld::SceneEvents::make(scene, *performers, rig.size(), 1, rays);
    EXPECT_TRUE(events);
    world = std::make_unique<simworld::SceneWorld>(scene, rig, std::move(*performers), std::move(*events), 1);
  }
  void go_to(double t_s) {
    do world->step();
    while (world->t_s() < t_s);
  }
  std::uint32_t cameras(std::uint32_t marker) const { return world->truth().markers.at(marker).cameras; }

  std::unique_ptr<simworld::SceneWorld> world;
};

TEST(SceneWorld, SeesTheSameNumberOfMarkersInDrawnImages) {
  simworld::SceneFile scene = walker();
  World computed(scene, true);
  scene.drawn = true;
  World drawn(scene, true);

  computed.go_to(0.02);
  drawn.go_to(0.02);

  std::uint32_t sum = 0, drawn_sum = 0;
  for (std::uint32_t m = 0; m < 41; ++m) {
    sum += computed.cameras(m);
    drawn_sum += drawn.cameras(m);
  }
  EXPECT_NEAR(drawn_sum, sum, 0.01 * sum);  // 8 cameras with about 30 markers each
}

TEST(SceneWorld, SeesNothingInABlackout) {
  simworld::SceneFile scene = walker();
  scene.blackouts.push_back({.first_s = 1.0, .for_s = 0.5});
  World world(scene, true);

  world.go_to(0.9);
  EXPECT_GT(world.world->frames()[0].blobs.size(), 20U);
  world.go_to(1.2);

  for (const BlobFrame& frame : world.world->frames()) EXPECT_TRUE(frame.blobs.empty());
  EXPECT_EQ(world.cameras(0), 0U);
  EXPECT_EQ(world.world->truth().markers.size(), 41U);
  world.go_to(1.6);
  EXPECT_GT(world.cameras(0), 1U);
}

TEST(SceneWorld, DeliversNoImageInAnImageLossThenOneCameraAfterTheOther) {
  simworld::SceneFile scene = walker();
  scene.image_losses.push_back({.first_s = 1.0, .for_min_s = 0.5, .for_max_s = 0.5, .return_s = 0.4});
  World world(scene, true);

  world.go_to(0.9);
  const std::size_t cameras = world.world->rig().size();
  EXPECT_EQ(world.world->frames().size(), cameras);
  world.go_to(1.4);
  EXPECT_TRUE(world.world->frames().empty());
  EXPECT_EQ(world.world->truth().views, 0U);
  std::set<std::size_t> counts;
  while (world.world->t_s() < 1.95) {
    world.world->step();
    counts.insert(world.world->frames().size());
  }

  EXPECT_GT(counts.size(), 3U);
  EXPECT_EQ(*counts.rbegin(), cameras);
}

TEST(SceneWorld, HidesTheConfiguredShareOfMarkers) {
  simworld::SceneFile scene = walker();
  scene.occlusion = false;
  scene.hides.push_back({.from_s = 0.0, .share = 0.3, .for_s = 0.2});
  World world(scene, true);

  int hidden = 0, all = 0;
  for (int set = 0; set < 1200; ++set) {
    world.world->step();
    for (const scoring::NamedMarker& marker : world.world->truth().markers) {
      hidden += marker.cameras == 0 ? 1 : 0;
      ++all;
    }
  }

  // About 1700 hidden intervals of 0.2 s: their number varies by 2 %, and the time between them by the same.
  EXPECT_NEAR(static_cast<double>(hidden) / all, 0.3, 0.02);
}

TEST(SceneWorld, HidesNamedMarkersInGapsOfDifferentLength) {
  simworld::SceneFile scene = walker();
  scene.occlusion = false;
  scene.hides.push_back({.from_s = 0.0, .share = 0.3, .for_s = 0.05, .for_p90_s = 0.3, .markers = "HeadTop HeadFront"});
  World world(scene, true);

  std::vector<int> gaps;  // sets
  int hidden = 0, others = 0, lasts = 0;
  for (int set = 0; set < 60'000; ++set) {
    world.world->step();
    const auto& markers = world.world->truth().markers;
    for (std::size_t m = 0; m < markers.size(); ++m) {
      if (markers[m].cameras == 0) (m < 2 ? hidden : others) += 1;
    }
    if (markers[0].cameras == 0) {
      ++lasts;
    } else if (lasts > 0) {
      gaps.push_back(std::exchange(lasts, 0));
    }
  }
  std::ranges::sort(gaps);

  EXPECT_EQ(others, 0);
  EXPECT_NEAR(hidden / 120'000.0, 0.3, 0.04);
  ASSERT_GT(gaps.size(), 500U);
  EXPECT_NEAR(gaps[gaps.size() / 2], 0.05 * scene.rate_hz, 2.0);
  EXPECT_NEAR(gaps[gaps.size() * 9 / 10], 0.3 * scene.rate_hz, 8.0);
}

// Cameras that separate the markers of fingers.
simworld::SceneFile studio(const std::string& motion) {
  simworld::SceneFile scene = walker();
  scene.ring = {.cameras = 8, .radius_m = 3.0, .height_m = 2.2, .width_px = 2048, .height_px = 2048, .hfov_rad = 0.87};
  scene.marker_diameter_mm = 8.0;
  scene.actors[0].motion = motion;
  return scene;
}

TEST(Scene, LabelsEveryShippedMarkerSetOfAPersonInEveryAct) {
  namespace fs = std::filesystem;
  int sets = 0;
  for (const fs::directory_entry& file : fs::directory_iterator(support::source_folder() + "/config/markersets")) {
    if (file.path().extension() != ".toml" || file.path().stem().string().starts_with("rigid")) continue;
    simworld::SceneFile scene = studio("tpose:1.5,walk:1.5,wave:1,jump:1.5,spin:1,crouch:1,hands:1.5");
    scene.seconds = support::kSanitized ? 2.0 : 9.0;
    scene.actors[0].marker_set = file.path();

    const auto outcome = run_scene(scene, "", {});

    ASSERT_TRUE(outcome) << outcome.error().message;
    EXPECT_GT(outcome->labels.at(0).f1().value_or(0.0), 0.98) << file.path();
    EXPECT_GT(outcome->labels.at(0).availability().value_or(0.0), 0.99) << file.path();
    ++sets;
  }
  EXPECT_GE(sets, 6);
}

// Joints of fingers have locked axes.
TEST(Scene, LabelsFingersThatBend) {
  simworld::SceneFile scene = studio("tpose:2,hands");
  scene.actors[0].marker_set = support::source_folder() + "/config/markersets/baseline51.toml";
  scene.score.below = "LeftHand RightHand";

  const auto outcome = run_scene(scene, "", {});

  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_GT(outcome->labels.at(0).f1().value_or(0.0), 0.98);
  EXPECT_LT(outcome->bones.at(0).joint_rms_mm().value_or(1e3), 5.0);
  EXPECT_EQ(outcome->each_bone.at(0).size(), 10U);
}

TEST(Scene, NamesABoneToScoreThatDoesNotExist) {
  simworld::SceneFile scene = walker();
  scene.score.below = "LeftPaw";

  const auto outcome = run_scene(scene, "", {});

  ASSERT_FALSE(outcome);
  EXPECT_NE(outcome.error().message.find("no bone 'LeftPaw'"), std::string::npos) << outcome.error().message;
}

TEST(SceneWorld, ShowsAMarkerToOnlyOneCamera) {
  simworld::SceneFile scene = walker();
  scene.only_camera.push_back({.actor = "walker",
                               .markers = "HeadTop",
                               .hidden = "HeadFront",
                               .bone = "Head",
                               .camera = 3,
                               .from_s = 0.5,
                               .for_s = 1.0});
  World with(scene, true), without(scene, false);

  with.go_to(1.0);
  without.go_to(1.0);

  EXPECT_EQ(with.cameras(0), 1U);
  EXPECT_EQ(with.cameras(1), 0U);
  EXPECT_EQ(without.cameras(0), 0U);
  with.go_to(1.6);
  EXPECT_GT(with.cameras(0), 1U);
}

TEST(SceneEvents, RefuseUnknownMarkersAndBones) {
  simworld::SceneFile scene = walker();
  const auto performers = simworld::make_performers(scene, "", 1);
  ASSERT_TRUE(performers);
  const auto fails = [&](const char* markers, const char* bone, int camera) {
    simworld::SceneOnlyCamera only;
    only.actor = "walker";
    only.markers = markers;
    only.bone = bone;
    only.camera = camera;
    scene.only_camera = {only};
    return !simworld::SceneEvents::make(scene, *performers, 8, 1, true).has_value();
  };

  EXPECT_TRUE(fails("Nose", "", 1));
  EXPECT_TRUE(fails("HeadTop", "Tail", 1));
  EXPECT_TRUE(fails("HeadTop", "Head", 9));
  EXPECT_FALSE(fails("HeadTop", "Head", 8));
}

TEST(Performers, MayDifferInSizeFromTheMarkerSet) {
  simworld::SceneFile scene = walker();
  scene.actors[0].size = 0.9;
  scene.actors[0].marker_error_mm = 5.0;
  const auto unknown = simworld::make_performers(scene, "", 1);
  scene.actors[0].stored = true;
  const auto stored = simworld::make_performers(scene, "", 1);
  ASSERT_TRUE(unknown && stored);

  const MarkerSet told = *settings::load_marker_set(scene.actors[0].marker_set);
  const auto offset = [](const MarkerSet& set) { return set.skeleton.bones[1].rest_offset_m; };
  EXPECT_TRUE(offset(unknown->at(0).actor->marker_set()).isApprox(0.9 * offset(told)));
  EXPECT_TRUE(offset(unknown->at(0).subject.marker_set).isApprox(offset(told)));
  EXPECT_FALSE(unknown->at(0).subject.fitted);
  EXPECT_TRUE(offset(stored->at(0).subject.marker_set).isApprox(0.9 * offset(told)));
  EXPECT_TRUE(stored->at(0).subject.fitted);
}

// Two actors with the same marker set, 2 m apart.
struct Twins {
  explicit Twins(bool stored) {
    simworld::SceneFile scene = walker();
    scene.actors.push_back(scene.actors[0]);
    scene.actors[1].name = "other";
    scene.actors[0].stored = scene.actors[1].stored = stored;
    performers = *simworld::make_performers(scene, "", 1);
    for (std::uint32_t s = 0; s < 2; ++s) {
      for (std::uint32_t m = 0; m < 6; ++m) {
        truth.markers.push_back({s, m, LabelState::Measured, {2.0 * s, 0.1 * m, 1.0}, 4});
        said.markers.push_back({s, m, LabelState::Measured, {2.0 - 2.0 * s, 0.1 * m, 1.0}, 4});
      }
    }
  }
  std::vector<simworld::Performer> performers;
  scoring::EvalFrame truth, said;
};

TEST(Recognition, MapsInterchangeableSubjectsOnceAndPermanently) {
  Twins twins(false);
  simworld::Recognition recognition(twins.performers);

  scoring::EvalFrame first = twins.said, later = twins.truth;
  recognition.apply(twins.truth, first);
  recognition.apply(twins.truth, later);

  EXPECT_EQ(first.markers[0].position_m, twins.truth.markers[0].position_m);
  EXPECT_NE(later.markers[0].position_m,
            twins.truth.markers[0].position_m);  // the labels are exchanged afterwards, which is an error
}

TEST(Recognition, DoesNotExchangeSubjectsWithStoredBodies) {
  Twins twins(true);
  simworld::Recognition recognition(twins.performers);

  scoring::EvalFrame said = twins.said;
  recognition.apply(twins.truth, said);

  EXPECT_EQ(said.markers[0].position_m, twins.said.markers[0].position_m);
}

}  // namespace scene_test
}  // namespace mocap::eval
