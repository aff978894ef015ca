#include "calibrate/wand_command.h"
#include "lib/cli/app.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <fstream>
#include <functional>
#include <iterator>

#include "geometry/rigid_fit.h"
#include "lib/simworld/wand_world.h"
#include "recording_file.h"
#include "settings/rig/rig_file.h"
#include "support/temporary_folder.h"

namespace mocap::calibrate {
namespace wand_command_test {

using calibration::Take;
using calibration::Wand;
using simworld::WandWorld;
using ::testing::HasSubstr;

const Wand kWand{{0.0, 0.16, 0.5}};

struct Outcome {
  int exit = 0;
  std::string output;
};

// Runs the subcommand with the arguments of a user.
Outcome run(const std::vector<std::string>& arguments) {
  cli::App app("test");
  WandOptions options;
  add_wand_command(app, options);
  std::vector<const char*> words{"mocap-calibrate", "wand"};
  for (const std::string& argument : arguments) words.push_back(argument.c_str());
  ::testing::internal::CaptureStderr();
  ::testing::internal::CaptureStdout();
  Outcome ran;
  const auto ended = app.parse(static_cast<int>(words.size()), words.data());
  ran.exit = ended ? *ended : run_wand(options);
  std::fflush(stdout);
  ran.output += ::testing::internal::GetCapturedStderr() + ::testing::internal::GetCapturedStdout();
  return ran;
}

class WandCommand : public ::testing::Test {
 protected:
  std::string path(const char* name) const { return (folder_.path() / name).string(); }

  // Runs on a recording, with `before` as the previous rig.
  Outcome run_on(const Take& take, const Rig& truth, const Rig& before, std::vector<std::string> more = {}) const {
    calibrate::testing::write_recording(path("take.blobs"), take, truth);
    EXPECT_TRUE(settings::save_rig(path("before.toml"), before, {}));
    std::vector<std::string> arguments{"--blobs", path("take.blobs"), "--rig", path("before.toml"),
                                       "--out",   path("rig.toml")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
  bool wrote() const { return std::filesystem::exists(path("rig.toml")); }

  support::TemporaryFolder folder_;
};

simworld::WandWorldSettings small_world() { return {.cameras = 5, .noise_px = 0.1, .seconds = 20.0, .rate_hz = 30.0}; }

TEST_F(WandCommand, WritesARigInTheWorldOfThePreviousRig) {
  WandWorld world(small_world(), kWand, 21);

  const Outcome ran = run_on(world.take(), world.truth(), world.truth());

  ASSERT_EQ(ran.exit, kExitOk) << ran.output;
  const auto rig = settings::load_rig(path("rig.toml"));
  ASSERT_TRUE(rig);
  for (std::size_t c = 0; c < rig->size(); ++c) {
    EXPECT_EQ((*rig)[c].name, world.truth()[c].name);
    EXPECT_LT(((*rig)[c].centre().v - world.truth()[c].centre().v).norm(), 2e-3) << "m, as the noise allows";
  }
}

TEST_F(WandCommand, WritesReportsBesideTheRig) {
  WandWorld world(small_world(), kWand, 25);

  const Outcome ran = run_on(world.take(), world.truth(), world.truth(),
                             {"--report", path("report.svg"), "--report", path("report.json")});

  ASSERT_EQ(ran.exit, kExitOk) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("against the previous rig"));
  std::ifstream json(path("report.json"));
  const std::string text{std::istreambuf_iterator<char>(json), {}};
  for (const char* key : {"\"cam5\"", "\"heldout_px\"", "\"coverage\"", "\"std_mm\"", "\"mismatch\"", "\"grade\""})
    EXPECT_THAT(text, HasSubstr(key));
  EXPECT_TRUE(std::filesystem::exists(path("report.svg")));
}

// The recording is not read: nothing would be left of live cameras.
TEST_F(WandCommand, RefusesFilesThatCannotBeWrittenBeforeItRecords) {
  const std::string missing = path("missing/report.svg");
  const auto config = folder_.write("mocapd.toml",
                                    "[capture]\nneeds_rig = false\n[[camera]]\nname = \"a\"\ndriver = \"replay\"\n"
                                    "folder = \".\"\n");

  const Outcome report = run({"--blobs", path("none.blobs"), "--out", path("rig.toml"), "--report", missing});
  const Outcome out = run({"--blobs", path("none.blobs"), "--out", path("missing/rig.toml")});
  const Outcome truth = run({"--blobs", path("none.blobs"), "--out", path("rig.toml"), "--truth", path("none.toml")});
  const Outcome no_rig = run({"--config", config.string(), "--fov", "60"});

  EXPECT_EQ(report.exit, kExitCannotWrite);
  EXPECT_THAT(report.output, HasSubstr("'" + missing + "' cannot be written: its folder '" + path("missing") + "'"));
  EXPECT_EQ(out.exit, kExitCannotWrite) << out.output;
  EXPECT_EQ(truth.exit, kExitConfig) << truth.output;
  EXPECT_EQ(no_rig.exit, kExitUsage) << no_rig.output;
  EXPECT_THAT(no_rig.output, HasSubstr("set the rig file to write with --out FILE, or [capture] rig"));
}

TEST_F(WandCommand, WritesTheRigAlthoughAReportFails) {
  WandWorld world(small_world(), kWand, 25);
  std::filesystem::create_directory(path("report.json"));  // a folder is no file that can be replaced
  Rig other = world.truth();
  for (CameraModel& camera : other) camera.name += " of another rig";
  ASSERT_TRUE(settings::save_rig(path("truth.toml"), other, {}));

  const Outcome reported =
      run_on(world.take(), world.truth(), world.truth(), {"--report", path("report.json"), "--moved"});
  EXPECT_EQ(reported.exit, kExitCannotWrite) << reported.output;
  EXPECT_TRUE(settings::load_rig(path("rig.toml")));

  std::filesystem::remove(path("rig.toml"));
  const Outcome compared =
      run_on(world.take(), world.truth(), world.truth(), {"--truth", path("truth.toml"), "--moved"});
  EXPECT_EQ(compared.exit, kExitData) << compared.output;
  EXPECT_THAT(compared.output, HasSubstr("0 cameras are in both rigs by name"));
  EXPECT_TRUE(settings::load_rig(path("rig.toml")));
}

TEST_F(WandCommand, EstimatesUnknownLensesAndAProvisionalFloor) {
  WandWorld world(small_world(), kWand, 22);
  calibrate::testing::write_recording(path("take.blobs"), world.take(), world.truth());

  const Outcome ran = run({"--blobs", path("take.blobs"), "--fov", "60", "--out", path("rig.toml")});

  ASSERT_EQ(ran.exit, kExitOk) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("floor: provisional"));
  const auto rig = settings::load_rig(path("rig.toml"));
  ASSERT_TRUE(rig);
  for (const CameraModel& camera : *rig) EXPECT_GT(camera.centre().v.z(), 0.5) << "cameras are above the floor";
}

TEST_F(WandCommand, KeepsAProvisionalFloorProvisional) {
  WandWorld world(small_world(), kWand, 26);
  calibrate::testing::write_recording(path("take.blobs"), world.take(), world.truth());
  ASSERT_TRUE(settings::save_rig(path("before.toml"), world.truth(), {{"floor", std::string("guessed")}}));

  const Outcome ran = run({"--blobs", path("take.blobs"), "--rig", path("before.toml"), "--out", path("rig.toml")});

  ASSERT_EQ(ran.exit, kExitOk) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("floor: provisional"));
  EXPECT_TRUE(settings::floor_is_guessed(path("rig.toml")));
}

TEST_F(WandCommand, MayBeRepeatedWithTheSameFieldOfView) {
  WandWorld world(small_world(), kWand, 22);
  calibrate::testing::write_recording(path("take.blobs"), world.take(), world.truth());
  const std::vector<std::string> arguments{"--blobs", path("take.blobs"), "--fov", "60", "--out", path("rig.toml")};

  const Outcome first = run(arguments);
  const auto before = settings::load_rig(path("rig.toml"));
  const Outcome second = run(arguments);
  const auto after = settings::load_rig(path("rig.toml"));

  ASSERT_EQ(first.exit, kExitOk) << first.output;
  ASSERT_EQ(second.exit, kExitOk) << second.output;
  ASSERT_TRUE(before && after);
  for (std::size_t c = 0; c < after->size(); ++c) {
    EXPECT_TRUE((*after)[c].lens.is_from_fov);
    EXPECT_NEAR((*after)[c].lens.fx_px / (*before)[c].lens.fx_px, 1.0, 1e-4) << "the same guess, not the lens before";
    EXPECT_LT(((*after)[c].centre().v - (*before)[c].centre().v).norm(), 1e-3) << "m, in the world of the rig before";
  }
}

TEST_F(WandCommand, ReplacesCalibratedLensesOnlyOnRequest) {
  WandWorld world(small_world(), kWand, 22);
  calibrate::testing::write_recording(path("take.blobs"), world.take(), world.truth());
  const Rig before(world.truth().begin(), world.truth().end() - 1);
  ASSERT_TRUE(settings::save_rig(path("rig.toml"), before, {}));
  std::vector<std::string> arguments{"--blobs", path("take.blobs"), "--fov", "60", "--out", path("rig.toml")};

  const Outcome mixed = run(arguments);
  const auto kept = settings::load_rig(path("rig.toml"));
  arguments.push_back("--refine-lens");
  const Outcome asked = run(arguments);
  const auto replaced = settings::load_rig(path("rig.toml"));

  ASSERT_EQ(mixed.exit, kExitOk) << mixed.output;
  EXPECT_THAT(mixed.output, HasSubstr("calibrated lenses are kept"));
  EXPECT_THAT(mixed.output, HasSubstr("'cam3', 'cam4'\n"));
  ASSERT_TRUE(kept && kept->size() == 5);
  for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR((*kept)[c].lens.fx_px, before[c].lens.fx_px, 1e-9);
  EXPECT_TRUE((*kept)[4].lens.is_from_fov);
  ASSERT_EQ(asked.exit, kExitOk) << asked.output;
  ASSERT_TRUE(replaced);
  for (const CameraModel& camera : *replaced) EXPECT_TRUE(camera.lens.is_from_fov) << camera.name;
}

TEST_F(WandCommand, WritesNothingInADryRun) {
  WandWorld world(small_world(), kWand, 23);

  const Outcome ran = run_on(world.take(), world.truth(), world.truth(), {"--dry-run"});

  EXPECT_EQ(ran.exit, kExitOk) << ran.output;
  EXPECT_FALSE(wrote());
}

TEST_F(WandCommand, KeepsTheRigFileIfARecordingIsRefused) {
  WandWorld world(small_world(), kWand, 24);
  Take take = world.take();
  for (auto& picture : take.cameras[2]) picture.spots.clear();
  std::ofstream(path("rig.toml")) << "# mine\n";

  const Outcome ran = run_on(take, world.truth(), world.truth());

  EXPECT_EQ(ran.exit, kExitData);
  std::ifstream file(path("rig.toml"));
  std::string text;
  std::getline(file, text);
  EXPECT_EQ(text, "# mine");
}

// --- refused recordings

struct World {
  WandWorld sim;
  Take take;
  Rig before;
  std::vector<std::string> more;

  explicit World(std::uint64_t seed, simworld::WandWorldSettings settings = small_world(), const Wand& wand = kWand)
      : sim(settings, wand, seed), take(sim.take()), before(sim.truth()) {}
};

struct Bad {
  const char* name;
  std::function<World()> world;
  std::vector<const char*> message;  // parts of it
};

World without_overlap() {
  World world(31);
  for (std::size_t c = 0; c < world.take.cameras.size(); ++c) {
    const std::size_t third = world.take.cameras[c].size() / 3;
    for (std::size_t i = 0; i < world.take.cameras[c].size(); ++i) {
      if ((c == 3) != (i < third)) world.take.cameras[c][i].spots.clear();
    }
  }
  return world;
}

World with_few_samples() {
  auto settings = small_world();
  settings.seconds = 1.5;
  return World(32, settings);
}

World with_markers_in_another_order() {
  World world(33);
  world.more = {"--wand", "0,250,500"};
  return world;
}

World with_a_middle_marker_a_little_off() {
  World world(34, small_world(), Wand{{0.0, 0.17, 0.5}});
  return world;
}

World with_a_wand_of_another_length() {
  World world(35, small_world(), Wand{{0.0, 0.128, 0.4}});
  return world;
}

World with_two_wands() {
  World world(36);
  WandWorld second(small_world(), kWand, 37);
  const Take other = second.take();
  for (std::size_t c = 0; c < other.cameras.size(); ++c) {
    for (std::size_t i = 0; i < other.cameras[c].size(); ++i) {
      auto& spots = world.take.cameras[c][i].spots;
      spots.insert(spots.end(), other.cameras[c][i].spots.begin(), other.cameras[c][i].spots.end());
    }
  }
  return world;
}

World with_a_still_wand() {
  auto settings = small_world();
  settings.body = false;
  settings.false_blobs = 0.0;
  World world(38, settings);
  for (auto& camera : world.take.cameras) {
    for (auto& picture : camera) picture.spots = camera.front().spots;
  }
  return world;
}

World with_a_late_camera() {
  World world(39);
  // The time stamps of the second camera are 8 ms early.
  auto settings = small_world();
  settings.rate_hz = 500.0;
  WandWorld fine(settings, kWand, 39);
  const Take all = fine.take();
  for (std::size_t c = 0; c < world.take.cameras.size(); ++c) {
    for (std::size_t i = 0; i < world.take.cameras[c].size(); ++i) {
      const auto at = static_cast<std::size_t>(std::llround(static_cast<double>(i) / 30.0 * 500.0)) + (c == 1 ? 4 : 0);
      auto& picture = world.take.cameras[c][i];
      picture.exposed_at =
          all.cameras[c][std::min(at, all.cameras[c].size() - 1) - (c == 1 && at >= 4 ? 4 : 0)].exposed_at;
      picture.spots = all.cameras[c][std::min(at, all.cameras[c].size() - 1)].spots;
    }
  }
  return world;
}

World with_a_mirrored_camera() {
  World world(40);
  for (auto& picture : world.take.cameras[2]) {
    for (auto& spot : picture.spots) spot.at.v.x() = world.before[2].width_px - 1 - spot.at.v.x();
  }
  return world;
}

World with_a_lens_file_of_another_size() {
  World world(41);
  world.before[1].width_px /= 2;
  world.before[1].height_px /= 2;
  return world;
}

World with_a_blind_camera() {
  World world(42);
  for (auto& picture : world.take.cameras[4]) picture.spots.clear();
  return world;
}

World with_a_camera_that_is_in_no_rig() {
  World world(43);
  world.before[0].name = "another";
  return world;
}

const std::vector<Bad> kBad{
    {"no overlap", without_overlap, {"no overlap", "'cam4'"}},
    {"few samples", with_few_samples, {"camera 'cam", "expected at least 60; wave", "more samples"}},
    {"wrong order", with_markers_in_another_order, {"divides the line at 0.32, expected 0.50"}},
    {"middle marker off",
     with_a_middle_marker_a_little_off,
     {"middle marker of the wand is at 170 mm of 500, expected 160"}},
    {"wrong length",
     with_a_wand_of_another_length,
     {"1.250 times as far apart", "the wand is 400 mm long, expected 500"}},
    {"two wands", with_two_wands, {"two wands in"}},
    {"still wand", with_a_still_wand, {"does not move"}},
    {"not synchronised", with_a_late_camera, {"camera 'cam2'", "about 8.", "ms later than"}},
    {"mirrored", with_a_mirrored_camera, {"camera 'cam3': its images are mirrored"}},
    {"another size", with_a_lens_file_of_another_size, {"camera 'cam2'", "1280x1024", "640x512"}},
    {"blind camera", with_a_blind_camera, {"camera 'cam5': no wand in any of 600 images"}},
    {"unknown camera", with_a_camera_that_is_in_no_rig, {"camera 'cam1': its lens is unknown"}},
};

class BadRecording : public WandCommand, public ::testing::WithParamInterface<std::size_t> {};

TEST_P(BadRecording, IsRefusedWithAMessageAndWritesNoRig) {
  const Bad& bad = kBad[GetParam()];
  World world = bad.world();

  const Outcome ran = run_on(world.take, world.sim.truth(), world.before, world.more);

  EXPECT_NE(ran.exit, kExitOk) << bad.name;
  for (const char* part : bad.message) EXPECT_THAT(ran.output, HasSubstr(part)) << bad.name;
  EXPECT_FALSE(wrote()) << bad.name;
}

INSTANTIATE_TEST_SUITE_P(All, BadRecording, ::testing::Range(std::size_t{0}, kBad.size()));

TEST_F(WandCommand, RefusesFilesThatAreNotRecordings) {
  const auto garbage = folder_.write("garbage.blobs", "P5 640 480 255 ...").string();
  const auto newer = folder_.write("newer.blobs", std::string("mocapblobs\n\x02\x08\x07", 14)).string();
  const auto empty = folder_.write("empty.blobs", "").string();

  EXPECT_THAT(run({"--blobs", garbage, "--out", path("rig.toml")}).output, HasSubstr("is no blob recording"));
  EXPECT_THAT(run({"--blobs", newer, "--out", path("rig.toml")}).output, HasSubstr("has version 7, expected 1 to 1"));
  EXPECT_THAT(run({"--blobs", empty, "--out", path("rig.toml")}).output, HasSubstr("is no blob recording"));
  EXPECT_EQ(run({"--blobs", path("none.blobs"), "--out", path("rig.toml")}).exit, kExitNoInput);
  EXPECT_EQ(run({"--blobs", folder_.path().string(), "--out", path("rig.toml")}).exit, kExitNoInput);
  EXPECT_FALSE(wrote());
}

TEST_F(WandCommand, RefusesARecordingThatCannotBeWrittenWithItsOwnCode) {
  const auto config = folder_.write("mocapd.toml",
                                    "[capture]\nneeds_rig = false\n[[camera]]\nname = \"a\"\ndriver = \"replay\"\n"
                                    "folder = \".\"\n");
  const std::vector<std::string> arguments{"--config", config.string(), "--out", path("rig.toml"), "--record"};
  const auto with = [&](const std::string& record) {
    auto all = arguments;
    all.push_back(record);
    return run(all);
  };

  const Outcome folder = with(path("missing/take.blobs"));
  const Outcome name = with(path("take.txt"));

  EXPECT_EQ(folder.exit, kExitCannotWrite) << folder.output;
  EXPECT_EQ(name.exit, kExitUsage) << name.output;
  EXPECT_THAT(name.output, HasSubstr("expected .blobs"));
}

TEST_F(WandCommand, RefusesInvalidWands) {
  for (const char* wand : {"600", "0,500,160", "0", "10,500", "0,a,500", "0,1,2,3", "", "0,16,50"}) {
    const Outcome ran = run({"--blobs", "any.blobs", "--out", path("rig.toml"), "--wand", wand});
    EXPECT_EQ(ran.exit, kExitUsage) << wand;
  }
}

}  // namespace wand_command_test
}  // namespace mocap::calibrate
