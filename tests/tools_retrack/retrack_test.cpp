#include "lib/retrack/retrack.h"

#include <gmock/gmock.h>

#include <fstream>
#include <random>

#include "tools_retrack/recorded_world.h"

namespace mocap::retrack {
namespace retrack_test {

using ::testing::HasSubstr;

class Retrack : public testing::Test {
 protected:
  Result<RetrackReport> again(const std::filesystem::path& take, RetrackOrder order = {}) {
    order.take = take;
    if (order.out.empty()) order.out = world_.folder() / "again.mcap";
    return retrack(order, [&](const RetrackProgress& progress) {
      shares_.push_back(progress.share);
      return shares_.size() != end_at_;
    });
  }

  RecordedWorld world_;
  std::vector<double> shares_;
  std::size_t end_at_ = 1000;  // the call of `progress` that ends the work
};

TEST_F(Retrack, GivesTheRecordedSnapshotsByteForByte) {
  const auto take = world_.record("walk", {});

  const auto report = again(take);

  ASSERT_TRUE(report) << report.error().message;
  const std::vector<std::string> recorded = snapshots_in(take), tracked = snapshots_in(report->path);
  EXPECT_EQ(recorded.size(), 300U);
  EXPECT_TRUE(recorded == tracked) << "first difference at set " << report->first_difference.value_or(0);
  EXPECT_EQ(report->sets, 300U);
  EXPECT_EQ(report->equal, 300U);
  EXPECT_TRUE(report->from_start_of_run);
  EXPECT_FALSE(report->first_difference);
  v1::Snapshot last;
  ASSERT_TRUE(last.ParseFromString(tracked.back()));
  EXPECT_EQ(last.subjects(0).phase(), v1::SUBJECT_PHASE_TRACKING) << "the comparison would mean nothing";
  EXPECT_GT(last.description_version(), 1U);
}

TEST_F(Retrack, UsesDiscsThatTheBorderOfTheImageCutsOff) {
  const auto take = world_.record("walk", {.sets = 60, .cut_disc = true});

  const auto report = again(take);

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->damaged, 0U);
  EXPECT_EQ(report->equal, 60U);
}

TEST_F(Retrack, UsesTheSetsThatTheDaemonFused) {
  const auto take = world_.record("walk", {.sets = 240, .passed_over = 7, .late = 5});

  const auto report = again(take);

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_LT(report->sets, 240U);
  EXPECT_EQ(report->equal, report->recorded);
  EXPECT_TRUE(snapshots_in(take) == snapshots_in(report->path));
}

TEST_F(Retrack, CanUseEverySet) {
  const auto take = world_.record("walk", {.sets = 200, .passed_over = 7, .late = 5});

  const auto report = again(take, {.every_set = true});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->sets, 200U);
  EXPECT_EQ(report->recorded, 0U);
}

TEST_F(Retrack, FormsTheSetsOfATakeWithoutSnapshots) {
  const auto take = world_.record("walk", {.sets = 150, .snapshots = false});

  const auto report = again(take);

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->sets, 150U);
  EXPECT_EQ(snapshots_in(report->path).size(), 150U);
}

TEST_F(Retrack, FindsTheSubjectOfATakeThatBeganWhileItWasTracked) {
  const auto take = world_.record("walk", {.sets = 300, .from = 200});

  const auto report = again(take);

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_FALSE(report->from_start_of_run);
  EXPECT_EQ(report->sets, 100U);
  v1::Snapshot last;
  ASSERT_TRUE(last.ParseFromString(snapshots_in(report->path).back()));
  EXPECT_EQ(last.subjects(0).phase(), v1::SUBJECT_PHASE_TRACKING) << "its body is in the description of the take";
}

TEST_F(Retrack, TracksATakeWithADamagedBeliefFromNothing) {
  const auto take = world_.record("walk", {.sets = 300, .from = 200, .belief = "damaged"});

  const auto report = again(take);

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_FALSE(report->from_belief);
  EXPECT_EQ(report->sets, 100U);
}

TEST_F(Retrack, WritesTheRestOfTheTakeAsItWas) {
  const auto path = world_.record("walk", {.sets = 100});

  const auto report = again(path);

  ASSERT_TRUE(report) << report.error().message;
  const auto take = take::TakeReader::open(path), made = take::TakeReader::open(report->path);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->counts(), take->counts());
  EXPECT_EQ(made->files(), take->files());
  EXPECT_EQ(made->info().name, "again");
  EXPECT_EQ(made->info().notes, "first try");
  EXPECT_EQ(made->info().others.at("retracked_from"), "walk.mcap");
  EXPECT_TRUE(made->info().others.contains("quality"));
  EXPECT_EQ(made->info().started_at, take->info().started_at);
  EXPECT_FALSE(made->cut_off());
}

TEST_F(Retrack, OfItsOwnResultGivesTheSameAgain) {
  const auto first = again(world_.record("walk", {.sets = 200}));
  ASSERT_TRUE(first) << first.error().message;

  const auto second = again(first->path, {.out = world_.folder() / "third.mcap"});

  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(second->equal, 200U);
}

TEST_F(Retrack, WritesARangeOfWhatItTracked) {
  const auto take = world_.record("walk", {.sets = 240});

  const auto report = again(take, {.from = from_s(2.0), .to = from_s(2.5)});

  ASSERT_TRUE(report) << report.error().message;
  const std::vector<std::string> recorded = snapshots_in(take), tracked = snapshots_in(report->path);
  ASSERT_EQ(tracked.size(), 30U);
  EXPECT_TRUE(std::equal(tracked.begin(), tracked.end(), recorded.begin() + 120));
  const auto made = take::TakeReader::open(report->path);
  EXPECT_GT(made->description()->version, 0U);
  std::uint32_t version = 0;
  take::TakeCursor cursor = made->messages({.topics = {take::TakeTopic::Description}});
  for (auto record = cursor.next(); record && *record; record = cursor.next()) {
    version = take::description_of(**record)->version;
  }
  v1::Snapshot snapshot;
  ASSERT_TRUE(snapshot.ParseFromString(tracked.front()));
  EXPECT_EQ(version, snapshot.description_version()) << "the bodies that were fitted before the range are in the file";
}

TEST_F(Retrack, TellsItsProgress) {
  ASSERT_TRUE(again(world_.record("walk", {.sets = 250})));

  ASSERT_EQ(shares_.size(), 2U);
  EXPECT_NEAR(shares_[0], 0.4, 0.01);
  EXPECT_NEAR(shares_[1], 0.8, 0.01);
}

TEST_F(Retrack, ReplacesNoFile) {
  const auto take = world_.record("walk", {.sets = 10});

  const auto refused = again(take, {.out = take});

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("walk-2.mcap"));
  EXPECT_EQ(snapshots_in(take).size(), 10U);
  EXPECT_FALSE(again(take, {.out = world_.folder() / "again.pb"})) << "not a take";
}

TEST_F(Retrack, UsesAnotherRig) {
  const auto take = world_.record("walk", {.sets = 200});
  Rig bumped = world_.settings().rig;
  bumped[1].camera_from_world.translation.x() += 0.05;
  ASSERT_TRUE(settings::save_rig(world_.folder() / "bumped.toml", bumped, {}));

  const auto report = again(take, {.others = {.rig = world_.folder() / "bumped.toml"}});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_LT(report->equal, 10U);
  const auto made = take::TakeReader::open(report->path);
  EXPECT_TRUE(made->file("rig/bumped.toml"));
  EXPECT_FALSE(made->file("rig/rig.toml"));
  EXPECT_NEAR(made->description()->cameras[1].camera_from_world.translation.x(),
              bumped[1].camera_from_world.translation.x(), 1e-9);
}

// The take begins while the person walks: the daemon needs some sets to find the person again.
TEST_F(Retrack, OfflineHasLabelsFromTheFirstSetOn) {
  const auto take = world_.record("walk", {.sets = 320, .from = 200});
  const auto phases = [](const std::filesystem::path& path) {
    std::vector<v1::SubjectPhase> all;
    for (const std::string& bytes : snapshots_in(path)) {
      v1::Snapshot snapshot;
      EXPECT_TRUE(snapshot.ParseFromString(bytes));
      all.push_back(snapshot.subjects(0).phase());
    }
    return all;
  };
  const auto live = again(take, {.out = world_.folder() / "live.mcap"});
  shares_.clear();

  const auto report = again(take, {.offline = true});

  ASSERT_TRUE(live) << live.error().message;
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_NE(phases(live->path).front(), v1::SUBJECT_PHASE_TRACKING) << "the comparison would mean nothing";
  EXPECT_EQ(phases(report->path), std::vector(120, v1::SUBJECT_PHASE_TRACKING));
  EXPECT_EQ(report->sets, 120U);
  EXPECT_TRUE(std::ranges::is_sorted(shares_));
  const auto made = take::TakeReader::open(report->path), from = take::TakeReader::open(take);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->counts().at("blobs/cam1"), from->counts().at("blobs/cam1"));
}

// The median over the measured markers of all sets.
double residual_px(const std::filesystem::path& take) {
  std::vector<double> all_px;
  for (const std::string& bytes : snapshots_in(take)) {
    v1::Snapshot snapshot;
    EXPECT_TRUE(snapshot.ParseFromString(bytes));
    for (const v1::SubjectState& subject : snapshot.subjects()) {
      const v1::LabelledMarkers& markers = subject.markers();
      for (int i = 0; i < markers.states_size(); ++i) {
        if (markers.states(i) == v1::MARKER_STATE_MEASURED) all_px.push_back(markers.residuals_millipx(i) / 1000.0);
      }
    }
  }
  EXPECT_GT(all_px.size(), 1000U) << "labelled markers";
  std::ranges::nth_element(all_px, all_px.begin() + static_cast<std::ptrdiff_t>(all_px.size() / 2));
  return all_px[all_px.size() / 2];
}

// One camera moved by 5 mm and turned by 0.3 degrees after its calibration.
TEST(RetrackWithAMendedRig, HasTheResidualsOfTheRightRig) {
  const RecordedWorld right;
  const RecordedWorld wrong([](Rig& rig) {
    rig[1].camera_from_world.translation.x() += 0.005;
    rig[1].camera_from_world.rotation *= Eigen::AngleAxisd(0.005, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  });
  const auto of_right = right.record("walk", {.sets = 240}), of_wrong = wrong.record("walk", {.sets = 240});
  const auto mended = wrong.folder() / "mended.toml";
  ASSERT_TRUE(settings::save_rig(mended, wrong.true_rig(), {}));
  const auto order = [&](OtherFiles others) {
    return RetrackOrder{.take = of_wrong, .out = wrong.folder() / "again.mcap", .others = std::move(others)};
  };

  const auto report = retrack(order({.rig = mended}), [](const RetrackProgress&) { return true; });

  ASSERT_TRUE(report) << report.error().message;
  const double expected_px = residual_px(of_right);
  EXPECT_GT(residual_px(of_wrong), 3.0 * expected_px) << "the comparison would mean nothing";
  EXPECT_NEAR(residual_px(report->path), expected_px, 0.001) << "rounding to 0.001 px";
  EXPECT_TRUE(snapshots_in(report->path) == snapshots_in(of_right));
}

TEST_F(Retrack, RefusesARigThatLacksACamera) {
  const auto take = world_.record("walk", {.sets = 10});
  Rig rig = world_.settings().rig;
  rig.pop_back();
  ASSERT_TRUE(settings::save_rig(world_.folder() / "three.toml", rig, {}));

  const auto refused = again(take, {.others = {.rig = world_.folder() / "three.toml"}});

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("has no camera 'cam4'"));
}

TEST_F(Retrack, KeepsAWholeNewTakeOfTheSameOrder) {
  const auto take = world_.record("walk", {.sets = 60});
  ASSERT_TRUE(again(take));
  const auto written = std::filesystem::last_write_time(world_.folder() / "again.mcap");

  const auto same = again(take, {.resume = true});
  const auto shorter = again(take, {.to = std::chrono::milliseconds(500), .resume = true});
  const auto plain = again(take);

  ASSERT_TRUE(same) << same.error().message;
  EXPECT_TRUE(same->kept);
  EXPECT_EQ(same->sets, 0U);
  ASSERT_FALSE(shorter);
  EXPECT_THAT(shorter.error().message,
              HasSubstr("was made of another take, with other settings or by another version"));
  ASSERT_FALSE(plain);
  EXPECT_THAT(plain.error().message, HasSubstr("the next free name is"));
  EXPECT_EQ(std::filesystem::last_write_time(world_.folder() / "again.mcap"), written);
}

TEST_F(Retrack, DoesNotKeepADamagedNewTake) {
  const auto take = world_.record("walk", {.sets = 60});
  const auto made = again(take);
  ASSERT_TRUE(made);
  std::fstream file(made->path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(std::filesystem::file_size(made->path) / 2));
  file.put('\x55').put('\x55').put('\x55');
  file.close();

  const auto refused = again(take, {.resume = true});

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("is damaged"));
}

TEST_F(Retrack, LeavesNothingIfItIsEnded) {
  const auto take = world_.record("walk", {.sets = 250});
  const auto files = [&] {
    return std::distance(std::filesystem::directory_iterator(world_.folder()), std::filesystem::directory_iterator());
  };
  const auto before = files();
  for (const bool offline : {false, true}) {
    for (std::size_t call = 1; call <= 2; ++call) {
      shares_.clear();
      end_at_ = call;

      const auto ended = again(take, {.offline = offline});

      ASSERT_FALSE(ended);
      EXPECT_EQ(ended.error().code, ErrorCode::EndOfStream);
      EXPECT_EQ(shares_.size(), call);
      EXPECT_EQ(files(), before);
    }
  }
}

TEST_F(Retrack, TracksAChunkWithTheBodyThatTheTakeHasThere) {
  const auto take = world_.record("walk", {.sets = 360});
  const Chunk second{.number = 2, .of = 2, .overlap = from_s(0.5)};

  const auto report = again(take, {.chunk = second});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->path, chunk_file(world_.folder() / "again.mcap", second));
  EXPECT_EQ(report->sets, 180U + 30U);
  EXPECT_FALSE(report->from_start_of_run);
  v1::Snapshot last;
  ASSERT_TRUE(last.ParseFromString(snapshots_in(report->path).back()));
  EXPECT_EQ(last.subjects(0).phase(), v1::SUBJECT_PHASE_TRACKING) << "nobody stands in a T-pose in this part";
}

TEST_F(Retrack, TracksTheFirstChunkAsTheWholeTake) {
  const auto take = world_.record("walk", {.sets = 200});

  const auto report = again(take, {.chunk = Chunk{.number = 1, .of = 2, .overlap = from_s(0.5)}});

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->sets, 100U);
  EXPECT_EQ(report->equal, 100U);
}

TEST_F(Retrack, KeepsAChunkThatIsThere) {
  const auto take = world_.record("walk", {.sets = 60});
  const RetrackOrder first{.chunk = Chunk{.number = 1, .of = 2, .overlap = from_s(0.5)}, .resume = true};
  RetrackOrder longer = first, whole = first;
  longer.chunk->overlap = from_s(0.6);
  whole.chunk.reset();

  ASSERT_TRUE(again(take, first));
  const auto kept = again(take, first), refused = again(take, longer);
  const auto tracked = again(take, whole), other = again(take, first);

  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_TRUE(kept->kept);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("with other settings"));
  ASSERT_TRUE(tracked) << tracked.error().message;
  EXPECT_FALSE(tracked->kept);
  EXPECT_FALSE(other) << "the new take is there, and was not made of chunks";
}

// Numbers in a take that no camera sends: the take is read, and nothing crashes.
TEST_F(Retrack, LeavesOutDamagedMessages) {
  const auto path = world_.record("walk", {.sets = 200});
  std::mt19937_64 random(5);
  const auto take = take::TakeReader::open(path);
  ASSERT_TRUE(take) << take.error().message;
  take::TakeStart start;
  start.info = RecordedWorld::info_of("damaged");
  start.description = *take->description();
  for (const std::string& name : take->files()) start.files.push_back({.name = name, .bytes = *take->file(name)});
  auto writer = take::TakeWriter::create(world_.folder() / "damaged.mcap", start, {.sync = false});
  ASSERT_TRUE(writer) << writer.error().message;
  take::TakeCursor cursor = take->messages({.topics = {take::TakeTopic::Snapshot, take::TakeTopic::Blobs}});
  for (auto record = cursor.next(); record && *record; record = cursor.next()) {
    const bool blobs = (*record)->topic == take::TakeTopic::Blobs;
    std::string bytes((*record)->bytes);
    if (random() % 3 == 0) {
      for (int i = 0; i < 4; ++i) bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    const auto copies = random() % 20 == 0 ? 2 : 1;
    const std::string topic = blobs ? "blobs/cam" + std::to_string(1 + random() % 4) : "snapshot";
    for (int i = 0; i < copies; ++i) ASSERT_TRUE((*writer)->append(topic, (*record)->at, bytes));
  }
  ASSERT_TRUE((*writer)->finish(start.info));

  const auto report = again(world_.folder() / "damaged.mcap");

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_GT(report->damaged, 0U);
}

}  // namespace retrack_test
}  // namespace mocap::retrack
