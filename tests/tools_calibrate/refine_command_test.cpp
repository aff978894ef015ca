#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <fstream>
#include <iterator>
#include <numbers>

#include "calibrate/floor_command.h"
#include "calibrate/verify_command.h"
#include "calibration/floor/floor.h"
#include "lib/cli/app.h"
#include "recording_file.h"
#include "scene/random.h"
#include "settings/rig/rig_file.h"
#include "support/bumped_camera.h"
#include "support/moving_markers.h"
#include "support/temporary_folder.h"

namespace mocap::calibrate {
namespace refine_command_test {

using calibration::Take;
using test::bumped;
using test::eight_cameras;
using test::moving_markers;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kDegree = std::numbers::pi / 180.0;

Take still_points(const Rig& rig, std::span<const Eigen::Vector3d> points, std::uint64_t seed, double seconds = 3.0) {
  scene::Random random(seed);
  Take take;
  for (double t = 0.0; t < seconds; t += 1.0 / 60.0) test::see_points(rig, points, t, random, take);
  return take;
}

struct Outcome {
  int exit = 0;
  std::string output;
};

template <class Options>
Outcome run(void (*add)(cli::App&, Options&), int (*run_it)(const Options&), const char* name,
            const std::vector<std::string>& arguments) {
  cli::App app("test");
  Options options;
  add(app, options);
  std::vector<const char*> words{"mocap-calibrate", name};
  for (const std::string& argument : arguments) words.push_back(argument.c_str());
  ::testing::internal::CaptureStderr();
  ::testing::internal::CaptureStdout();
  Outcome ran;
  EXPECT_EQ(app.parse(static_cast<int>(words.size()), words.data()), std::nullopt);
  ran.exit = run_it(options);
  std::fflush(stdout);
  ran.output = ::testing::internal::GetCapturedStderr() + ::testing::internal::GetCapturedStdout();
  return ran;
}

class RigCommands : public ::testing::Test {
 protected:
  std::string path(const char* name) const { return (folder_.path() / name).string(); }

  std::vector<std::string> files(const Take& take, const Rig& rig) const {
    calibrate::testing::write_recording(path("take.blobs"), take, rig);
    EXPECT_TRUE(settings::save_rig(path("rig.toml"), rig, {}));
    return {"--blobs", path("take.blobs"), "--rig", path("rig.toml")};
  }
  std::string text_of(const char* name) const {
    std::ifstream file(path(name));
    return {std::istreambuf_iterator<char>(file), {}};
  }
  Outcome verify(const std::vector<std::string>& arguments) const {
    return run<VerifyOptions>(add_verify_command, run_verify, "verify", arguments);
  }
  Outcome refine(const std::vector<std::string>& arguments) const {
    return run<RefineOptions>(add_refine_command, run_refine, "refine", arguments);
  }
  Outcome floor(const std::vector<std::string>& arguments) const {
    return run<FloorOptions>(add_floor_command, run_floor, "floor", arguments);
  }

  support::TemporaryFolder folder_;
};

TEST_F(RigCommands, VerifyAcceptsACorrectRig) {
  const Rig rig = eight_cameras();

  const Outcome ran = verify(files(moving_markers(rig, 1), rig));

  EXPECT_EQ(ran.exit, kExitOk) << ran.output;
  EXPECT_THAT(ran.output, Not(HasSubstr("deviates")));
}

TEST_F(RigCommands, VerifyAndRefineRefuseExchangedCameras) {
  Rig rig = eight_cameras();
  rig[2] = bumped(rig[2], 0.0, 0.3);  // without it the rig has symmetries
  rig[5] = bumped(rig[5], 0.0, -0.2);
  Take take = moving_markers(rig, 21);
  std::swap(take.cameras[2], take.cameras[5]);
  const auto arguments = files(take, rig);

  const Outcome verified = verify(arguments);
  const Outcome refined = refine(arguments);

  const std::string sentence = rig[2].name + " and " + rig[5].name + " fit if exchanged";
  EXPECT_EQ(verified.exit, kExitData);
  EXPECT_THAT(verified.output, HasSubstr(sentence));
  EXPECT_THAT(verified.output, HasSubstr("camera " + rig[2].name + ": does not fit the rig"));
  EXPECT_EQ(refined.exit, kExitData);
  EXPECT_THAT(refined.output, HasSubstr(sentence));
}

TEST_F(RigCommands, RefineRepairsABumpedCameraToHalfAMillimetre) {
  for (std::uint64_t seed = 2; seed < 5; ++seed) {
    const Rig file = eight_cameras();
    Rig truth = file;
    const std::size_t c = (3 * seed) % 8;
    truth[c] = bumped(truth[c], 0.3 * kDegree, 0.005);
    const auto arguments = files(moving_markers(truth, seed), file);

    const Outcome before = verify(arguments);
    const Outcome refined = refine(arguments);
    const Outcome after = verify(arguments);

    EXPECT_EQ(before.exit, kExitData);
    EXPECT_THAT(before.output, HasSubstr("camera " + file[c].name + ": deviates from the rig"));
    EXPECT_THAT(before.output, HasSubstr("1 of 8 cameras deviate"));
    ASSERT_EQ(refined.exit, kExitOk) << refined.output;
    EXPECT_EQ(after.exit, kExitOk) << after.output;
    const auto rig = settings::load_rig(path("rig.toml"));
    ASSERT_TRUE(rig);
    for (std::size_t i = 0; i < rig->size(); ++i)
      EXPECT_LT(((*rig)[i].centre().v - truth[i].centre().v).norm(), 5e-4) << "m, camera " << i;
  }
}

TEST_F(RigCommands, RefineRepairsABumpedCameraOfAFastRigWithTheImagesOfTheSameInstant) {
  const Rig file = eight_cameras();
  Rig truth = file;
  truth[3] = bumped(truth[3], 0.3 * kDegree, 0.005);
  const auto arguments = files(moving_markers(truth, 14, 5.0, 250.0), file);

  const Outcome refined = refine(arguments);

  ASSERT_EQ(refined.exit, kExitOk) << refined.output;
  const auto rig = settings::load_rig(path("rig.toml"));
  ASSERT_TRUE(rig);
  EXPECT_LT(((*rig)[3].centre().v - truth[3].centre().v).norm(), 5e-4) << "m; the image before is off by up to 2 mm";
}

// Appends a second recording of the same cameras.
Take then(Take first, const Take& second) {
  const Duration later = first.cameras[0].back().exposed_at - from_ns(0) + from_s(1.0 / 60.0);
  for (std::size_t c = 0; c < first.cameras.size(); ++c) {
    for (calibration::Picture picture : second.cameras[c]) {
      picture.exposed_at += later;
      first.cameras[c].push_back(std::move(picture));
    }
  }
  return first;
}

TEST_F(RigCommands, RefineUsesOnlyTheRecordingAfterABump) {
  const Rig file = eight_cameras();
  Rig truth = file;
  truth[5] = bumped(truth[5], 0.3 * kDegree, 0.005);
  const auto arguments = files(then(moving_markers(file, 11, 6.0), moving_markers(truth, 12)), file);

  const Outcome before = verify(arguments);
  const Outcome refined = refine(arguments);

  EXPECT_EQ(before.exit, kExitData);
  EXPECT_THAT(before.output, HasSubstr("camera " + file[5].name + ": was moved within the first"));
  EXPECT_THAT(before.output, HasSubstr("1 of 8 cameras deviate"));
  ASSERT_EQ(refined.exit, kExitOk) << refined.output;
  const auto rig = settings::load_rig(path("rig.toml"));
  ASSERT_TRUE(rig);
  for (std::size_t i = 0; i < rig->size(); ++i)
    EXPECT_LT(((*rig)[i].centre().v - truth[i].centre().v).norm(), 5e-4) << "m, camera " << i;
}

TEST_F(RigCommands, RefineImprovesARigWithSmallErrorsInAllCameras) {
  const Rig truth = eight_cameras();
  Rig file = truth;
  scene::Random random(9);
  for (CameraModel& camera : file) camera = bumped(camera, 0.02 * kDegree * random.normal(), 0.001 * random.normal());
  const auto arguments = files(moving_markers(truth, 6), file);

  const Outcome ran = refine(arguments);

  ASSERT_EQ(ran.exit, kExitOk) << ran.output;
  const auto rig = settings::load_rig(path("rig.toml"));
  ASSERT_TRUE(rig);
  double turn_before = 0.0;
  double turn_after = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const auto off = [&](const Rig& one) {
      return std::pow(Eigen::AngleAxisd(Eigen::Matrix3d(one[i].camera_from_world.rotation *
                                                        truth[i].camera_from_world.rotation.transpose()))
                          .angle(),
                      2);
    };
    turn_before += off(file);
    turn_after += off(*rig);
  }
  EXPECT_LT(turn_after, 0.3 * turn_before);
}

TEST_F(RigCommands, RefineRefusesARecordingWithoutMarkers) {
  const Rig rig = eight_cameras();
  Take take = moving_markers(rig, 7, 2.0);
  for (auto& camera : take.cameras) {
    for (auto& picture : camera) picture.spots.clear();
  }
  const auto arguments = files(take, rig);

  const Outcome verified = verify(arguments);
  const Outcome refined = refine(arguments);

  EXPECT_EQ(verified.exit, kExitData);
  EXPECT_THAT(verified.output, HasSubstr("8 of 8 cameras are undetermined"));
  EXPECT_EQ(refined.exit, kExitData);
  EXPECT_THAT(refined.output, HasSubstr("expected at least 50"));
}

// One marker that lies still.
const std::vector<Eigen::Vector3d> kOneMarker{{0.3, 0.2, 1.0}};

TEST_F(RigCommands, VerifyAndRefineDecideNothingByOneStillMarker) {
  const Rig truth = eight_cameras();
  Rig file = truth;  // a camera is rotated about its ray to the marker, which does not show in its image
  const Eigen::Vector3d ray = (truth[3].camera_from_world * WorldPoint{kOneMarker[0]}).v.normalized();
  const Eigen::AngleAxisd turn(3.0 * kDegree, ray);
  file[3].camera_from_world.rotation = turn * truth[3].camera_from_world.rotation;
  file[3].camera_from_world.translation = turn * truth[3].camera_from_world.translation;
  const auto arguments = files(still_points(truth, kOneMarker, 31), file);
  const std::string before = text_of("rig.toml");

  const Outcome verified = verify(arguments);
  const Outcome refined = refine(arguments);

  EXPECT_EQ(verified.exit, kExitData) << verified.output;
  EXPECT_THAT(verified.output, HasSubstr("camera " + file[3].name + ": undetermined; its markers cover"));
  EXPECT_THAT(verified.output, HasSubstr("8 of 8 cameras are undetermined"));
  EXPECT_EQ(refined.exit, kExitData) << refined.output;
  EXPECT_EQ(text_of("rig.toml"), before);
}

TEST_F(RigCommands, RefineRefusesABumpedCameraThatSawOneStillMarker) {
  const Rig file = eight_cameras();
  Rig truth = file;
  truth[5] = bumped(truth[5], 0.3 * kDegree, 0.005);
  const auto arguments = files(still_points(truth, kOneMarker, 32, 10.0), file);
  const std::string before = text_of("rig.toml");

  const Outcome refined = refine(arguments);

  EXPECT_EQ(refined.exit, kExitData);
  EXPECT_THAT(refined.output, HasSubstr("camera '" + file[5].name + "' was moved, and its"));
  EXPECT_THAT(refined.output, HasSubstr("move markers through the image"));
  EXPECT_EQ(text_of("rig.toml"), before);
}

TEST_F(RigCommands, RefineNamesACameraThatItCouldNotJudge) {
  Rig rig = eight_cameras();
  const Eigen::Vector3d centre = rig[4].centre().v;  // the markers are at the border of its image
  rig[4].camera_from_world.rotation =
      Eigen::AngleAxisd(45.0 * kDegree, Eigen::Vector3d::UnitY()) * rig[4].camera_from_world.rotation;
  rig[4].camera_from_world.translation = -(rig[4].camera_from_world.rotation * centre);

  const Outcome ran = refine(files(moving_markers(rig, 33), rig));

  EXPECT_EQ(ran.exit, kExitOk) << "the rig was written: a script may reload it";
  EXPECT_THAT(ran.output, HasSubstr("rig.toml: written"));
  EXPECT_THAT(ran.output, HasSubstr("camera " + rig[4].name + ": kept as it was: "));
  EXPECT_THAT(ran.output, HasSubstr("warning: 1 of 8 cameras could not be judged"));
  const auto refined = settings::load_rig(path("rig.toml"));
  ASSERT_TRUE(refined);
  EXPECT_LT(((*refined)[4].centre().v - rig[4].centre().v).norm(), 1e-9);
}

// The rig file has all cameras, the recording all but the third.
TEST_F(RigCommands, RefineTakesOverACameraThatTheRecordingLacks) {
  const Rig all = eight_cameras();
  Rig recorded = all;
  recorded.erase(recorded.begin() + 2);
  const auto arguments = files(moving_markers(recorded, 41), recorded);
  ASSERT_TRUE(settings::save_rig(path("rig.toml"), all, {}));

  const Outcome ran = refine(arguments);

  EXPECT_EQ(ran.exit, kExitOk) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("camera " + all[2].name + ": not in this recording, taken over"));
  const auto rig = settings::load_rig(path("rig.toml"));
  ASSERT_TRUE(rig);
  ASSERT_EQ(rig->size(), all.size());
  EXPECT_EQ(rig->back().name, all[2].name);
  EXPECT_LT((rig->back().centre().v - all[2].centre().v).norm(), 1e-9);
}

// The recording is not read: nothing would be left of live cameras.
TEST_F(RigCommands, RefineAndFloorRefuseAFileThatCannotBeWrittenBeforeTheyRecord) {
  ASSERT_TRUE(settings::save_rig(path("rig.toml"), eight_cameras(), {}));
  const auto config = folder_.write("mocapd.toml",
                                    "[capture]\nrig = \"missing/rig.toml\"\nneeds_rig = false\n[[camera]]\n"
                                    "name = \"a\"\ndriver = \"replay\"\nfolder = \".\"\n");
  const std::vector<std::string> of_config{"--config", config.string()};
  const std::vector<std::string> out{"--blobs", path("none.blobs"),      "--rig", path("rig.toml"),
                                     "--out",   path("missing/rig.toml")};
  std::vector<std::string> dry = out;
  dry.emplace_back("--dry-run");

  for (const auto& arguments : {of_config, out}) {
    const Outcome refined = refine(arguments);
    const Outcome placed = floor(arguments);

    EXPECT_EQ(refined.exit, kExitCannotWrite) << refined.output;
    EXPECT_EQ(placed.exit, kExitCannotWrite) << placed.output;
    EXPECT_THAT(placed.output, HasSubstr("cannot be written: its folder '" + path("missing") + "' does not exist"));
  }
  EXPECT_EQ(refine(dry).exit, kExitNoInput);
  EXPECT_EQ(floor(dry).exit, kExitNoInput);
}

// --- the floor -------------------------------------------------------------------------------------------------------

const std::vector<Eigen::Vector3d> kFrame{{0.0, 0.0, 0.0}, {0.6, 0.0, 0.0}, {0.0, 0.4, 0.0}};

// The same cameras in an arbitrary frame.
Rig without_floor(const Rig& rig) {
  Pose away;
  away.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d(1.0, 0.3, -0.4).normalized()));
  away.position = {1.0, -2.0, 0.5};
  return calibration::in_world({away, 0.0}, rig);
}

TEST_F(RigCommands, FloorMovesTheWorldOntoTheFloorFrame) {
  const Rig truth = eight_cameras();
  const auto arguments = files(still_points(truth, kFrame, 1), without_floor(truth));

  const Outcome ran = floor(arguments);

  ASSERT_EQ(ran.exit, kExitOk) << ran.output;
  const auto rig = settings::load_rig(path("rig.toml"));
  ASSERT_TRUE(rig);
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_LT(((*rig)[i].centre().v - truth[i].centre().v).norm(), 2e-3) << "m, 4 m off a frame of 0.6 m";
}

TEST_F(RigCommands, FloorMovesACameraThatTheRecordingLacks) {
  const Rig truth = eight_cameras();
  Rig recorded = truth;
  recorded.erase(recorded.begin() + 2);
  const auto arguments = files(still_points(recorded, kFrame, 8), without_floor(recorded));
  ASSERT_TRUE(settings::save_rig(path("rig.toml"), without_floor(truth), {}));

  const Outcome ran = floor(arguments);

  ASSERT_EQ(ran.exit, kExitOk) << ran.output;
  const auto rig = settings::load_rig(path("rig.toml"));
  ASSERT_TRUE(rig);
  ASSERT_EQ(rig->size(), truth.size());
  EXPECT_EQ(rig->back().name, truth[2].name);
  EXPECT_LT((rig->back().centre().v - truth[2].centre().v).norm(), 2e-3) << "m, as the others";
}

TEST_F(RigCommands, FloorRefusesAMirroredFrameAndAFrameOnTheCeiling) {
  const Rig truth = eight_cameras();
  const std::vector<Eigen::Vector3d> mirrored{{0.0, 0.0, 0.0}, {0.6, 0.0, 0.0}, {0.0, -0.4, 0.0}};
  const Outcome wrong_side = floor(files(still_points(truth, mirrored, 2), without_floor(truth)));
  // Cameras below the frame.
  Rig under = truth;
  for (CameraModel& camera : under)
    camera.camera_from_world = scene::look_at({camera.centre().v.x(), camera.centre().v.y(), -2.5}, {0.0, 0.0, 0.0});
  const Outcome ceiling = floor(files(still_points(under, kFrame, 3), without_floor(under)));

  EXPECT_EQ(wrong_side.exit, kExitData);
  EXPECT_THAT(wrong_side.output, HasSubstr("the world would be mirrored"));
  EXPECT_EQ(ceiling.exit, kExitData);
  EXPECT_THAT(ceiling.output, HasSubstr("the world would be upside down"));
}

TEST_F(RigCommands, FloorReportsAWrongScale) {
  Rig truth = eight_cameras();
  const Take take = still_points(truth, kFrame, 4);
  for (CameraModel& camera : truth) camera.camera_from_world.translation *= 1.25;

  const Outcome ran = floor(files(take, truth));

  EXPECT_EQ(ran.exit, kExitData);
  EXPECT_THAT(ran.output, HasSubstr("the floor frame is 1.250 times as large as expected"));
}

TEST_F(RigCommands, FloorRefusesMarkersThatFormNoFrame) {
  const Rig truth = eight_cameras();
  const std::vector<Eigen::Vector3d> two{{0.0, 0.0, 0.0}, {0.6, 0.0, 0.0}};

  const Outcome ran = floor(files(still_points(truth, two, 5), truth));

  EXPECT_EQ(ran.exit, kExitData);
  EXPECT_THAT(ran.output, HasSubstr("no floor frame among 2 stationary markers"));
}

TEST_F(RigCommands, FloorFitsThePlaneThroughMarkers) {
  const Rig truth = eight_cameras();
  const std::vector<Eigen::Vector3d> four{{-0.9, 0.1, 0.01}, {0.8, -0.2, 0.01}, {0.1, 0.9, 0.01}, {0.3, -0.8, 0.01}};

  auto arguments = files(still_points(truth, four, 6), without_floor(truth));
  arguments.insert(arguments.end(), {"--markers", "--height", "10"});
  const Outcome ran = floor(arguments);

  ASSERT_EQ(ran.exit, kExitOk) << ran.output;
  const auto rig = settings::load_rig(path("rig.toml"));
  ASSERT_TRUE(rig);
  for (const CameraModel& camera : *rig) EXPECT_NEAR(camera.centre().v.z(), 2.5, 3e-3);
}

// The frame lies there only in the first eight of 14 seconds.
TEST_F(RigCommands, FloorUsesAWholeRecording) {
  const Rig truth = eight_cameras();
  const Take take = then(still_points(truth, kFrame, 9, 8.0), still_points(truth, {}, 10, 6.0));
  auto arguments = files(take, without_floor(truth));

  const Outcome whole = floor(arguments);
  ASSERT_TRUE(settings::save_rig(path("rig.toml"), without_floor(truth), {}));
  arguments.insert(arguments.end(), {"--seconds", "5"});
  const Outcome last = floor(arguments);

  EXPECT_EQ(whole.exit, kExitOk) << whole.output;
  EXPECT_EQ(last.exit, kExitData) << last.output;
}

TEST_F(RigCommands, FloorSaysThatThreeMarkersAreNoCheck) {
  const Rig truth = eight_cameras();
  const std::vector<Eigen::Vector3d> three{{-0.9, 0.1, 0.0}, {0.8, -0.2, 0.0}, {0.1, 0.9, 0.3}};
  auto arguments = files(still_points(truth, three, 7), truth);
  arguments.emplace_back("--markers");

  const Outcome ran = floor(arguments);

  EXPECT_EQ(ran.exit, kExitOk) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("not checked: three markers always fit"));
  EXPECT_THAT(text_of("rig.toml"), Not(HasSubstr("floor_rms_mm")));
}

}  // namespace refine_command_test
}  // namespace mocap::calibrate
