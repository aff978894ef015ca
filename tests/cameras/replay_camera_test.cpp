#include "cameras/replay/replay_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

namespace mocap::cameras {
namespace replay_camera_test {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;

class ReplayCamera : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::path(testing::TempDir()) / (std::string("mocap_replay_") + test->name());
    fs::remove_all(root_);
    fs::create_directories(root_ / "north");
  }
  void TearDown() override { fs::remove_all(root_); }

  // Writes a 5x3 image with all pixels `grey`, in the format of netpbm and without a library.
  void write_pgm(const std::string& name, int grey) const {
    std::ofstream out(root_ / "north" / name, std::ios::binary);
    out << "P5\n5 3\n255\n" << std::string(15, static_cast<char>(grey));
  }
  void write_times(const std::string& text) const { std::ofstream(root_ / "north" / "timestamps.csv") << text; }
  ReplaySettings as_fast_as_possible() const {
    return {.folder = root_, .file = {}, .rate_hz = 50.0, .speed = 0.0, .loop = false};
  }

  fs::path root_;
};

struct Played {
  std::uint64_t number;
  std::int64_t exposed_ns;
  int grey;
  bool operator==(const Played&) const = default;
};
void PrintTo(const Played& p, std::ostream* out) {
  *out << "{" << p.number << ", " << p.exposed_ns << ", " << p.grey << "}";
}

// Plays up to `most` frames, or until the first error.
std::vector<Played> play(Camera& camera, std::size_t most = 100) {
  std::vector<Played> played;
  while (played.size() < most) {
    const Result<Frame> frame = camera.next(seconds(1));
    if (!frame) break;
    played.push_back({frame->number, to_ns(frame->exposed_at), static_cast<int>(frame->image.bytes.front())});
  }
  return played;
}

TEST_F(ReplayCamera, PlaysNumberedImagesAtTheirRecordedTimes) {
  write_pgm("000007.pgm", 70);
  write_pgm("000008.pgm", 80);
  write_pgm("000011.pgm", 110);
  write_times("frame,time_ns\n7,1000\n8,2000\n9,3000\n11,5500\n");
  const auto camera = make_replay_camera(CameraId{2}, "north", as_fast_as_possible());

  ASSERT_TRUE(camera->start());
  const Result<Frame> first = camera->next(seconds(0));

  ASSERT_TRUE(first);
  EXPECT_EQ(first->camera, CameraId{2});
  EXPECT_EQ(first->image.width_px, 5);
  EXPECT_EQ(first->image.height_px, 3);
  EXPECT_EQ(first->received_at, first->exposed_at);
  EXPECT_EQ(first->image.format, PixelFormat::Mono8);
  EXPECT_THAT(play(*camera), ElementsAre(Played{8, 2000, 80}, Played{11, 5500, 110}));
  EXPECT_EQ(camera->next(seconds(1)).error().code, ErrorCode::EndOfStream);
}

TEST_F(ReplayCamera, UsesAConstantRateWithoutTimestamps) {
  for (const int k : {0, 1, 3}) write_pgm("00000" + std::to_string(k) + ".pgm", k);
  ReplaySettings own_folder = as_fast_as_possible();
  own_folder.folder = root_ / "north";
  const auto camera = make_replay_camera(CameraId{0}, "north", own_folder);

  ASSERT_TRUE(camera->start());

  EXPECT_THAT(play(*camera), ElementsAre(Played{0, 0, 0}, Played{1, 20'000'000, 1}, Played{3, 60'000'000, 3}));
}

TEST_F(ReplayCamera, DeliversTheSameFramesEachTime) {
  for (int k = 0; k < 9; ++k) write_pgm("00000" + std::to_string(k) + ".pgm", k * 20);
  const auto camera = make_replay_camera(CameraId{0}, "north", as_fast_as_possible());

  ASSERT_TRUE(camera->start());
  const std::vector<Played> first = play(*camera);
  ASSERT_TRUE(camera->start());
  const std::vector<Played> second = play(*camera);

  EXPECT_EQ(first.size(), 9U);
  EXPECT_EQ(first, second);
}

TEST_F(ReplayCamera, KeepsTheRecordedPace) {
  write_pgm("000000.pgm", 0);
  write_pgm("000001.pgm", 1);
  write_times("frame,time_ns\n0,5000000000\n1,5400000000\n");
  ReplaySettings settings = as_fast_as_possible();
  settings.speed = 4.0;
  const auto camera = make_replay_camera(CameraId{0}, "north", settings);
  ASSERT_TRUE(camera->start());

  const Timestamp begun = host_now();
  ASSERT_TRUE(camera->next(seconds(0)));
  const Result<Frame> early = camera->next(milliseconds(1));
  const Result<Frame> due = camera->next(seconds(1));

  EXPECT_EQ(early.error().code, ErrorCode::Timeout);
  ASSERT_TRUE(due);
  EXPECT_EQ(to_ns(due->exposed_at), 5'400'000'000);
  EXPECT_GE(host_now() - begun, milliseconds(100));  // 400 ms at speed 4
  EXPECT_LT(host_now() - begun, milliseconds(350));  // the recorded pace takes 400 ms
}

TEST_F(ReplayCamera, ContinuesNumbersAndTimesInALoop) {
  write_pgm("000004.pgm", 4);
  write_pgm("000005.pgm", 5);
  write_times("frame,time_ns\n4,100\n5,110\n");
  ReplaySettings settings = as_fast_as_possible();
  settings.loop = true;
  const auto camera = make_replay_camera(CameraId{0}, "north", settings);

  ASSERT_TRUE(camera->start());

  EXPECT_THAT(play(*camera, 5), ElementsAre(Played{4, 100, 4}, Played{5, 110, 5}, Played{6, 120, 4}, Played{7, 130, 5},
                                            Played{8, 140, 4}));
}

TEST_F(ReplayCamera, NamesFileAndLineOfAWrongTimestamp) {
  write_pgm("000000.pgm", 0);
  const auto refusal_of = [&](const std::string& times) {
    write_times(times);
    const Status started = make_replay_camera(CameraId{0}, "north", as_fast_as_possible())->start();
    EXPECT_FALSE(started);
    return started ? "" : started.error().message;
  };

  EXPECT_THAT(refusal_of("0,1\n"), HasSubstr("timestamps.csv:1: the header is '0,1'"));
  EXPECT_THAT(refusal_of("frame,time_ns\n0,1\n1;2\n"), HasSubstr("timestamps.csv:3: '1;2' is no row"));
  EXPECT_THAT(refusal_of("frame,time_ns\n0,1.5\n"), HasSubstr("timestamps.csv:2: '0,1.5' is no row"));
  EXPECT_THAT(refusal_of("frame,time_ns\n3,1\n2,2\n"), HasSubstr("timestamps.csv:3: frame 2 follows frame 3"));
  EXPECT_THAT(refusal_of("frame,time_ns\n0,5\n1,5\n"), HasSubstr("timestamps.csv:3: frame 1 is not later"));
  EXPECT_THAT(refusal_of("frame,time_ns\n9,5\n"), HasSubstr("no row for frame 0"));
}

TEST_F(ReplayCamera, NamesTheFoldersThatItSearchedIfThereIsNoRecording) {
  const auto empty = make_replay_camera(CameraId{0}, "north", as_fast_as_possible());
  ReplaySettings nowhere = as_fast_as_possible();
  nowhere.folder = root_ / "nowhere";
  const auto missing = make_replay_camera(CameraId{0}, "north", nowhere);

  const Status nothing = empty->start();
  const Status no_folder = missing->start();

  EXPECT_EQ(nothing.error().code, ErrorCode::NotFound);
  EXPECT_THAT(nothing.error().message, HasSubstr("holds no numbered .pgm or .png and no video"));
  EXPECT_EQ(no_folder.error().code, ErrorCode::NotFound);
  EXPECT_THAT(no_folder.error().message, HasSubstr("nowhere"));
}

TEST_F(ReplayCamera, SkipsABrokenImage) {
  write_pgm("000000.pgm", 10);
  std::ofstream(root_ / "north" / "000001.pgm") << "not an image";
  write_pgm("000002.pgm", 30);
  const auto camera = make_replay_camera(CameraId{0}, "north", as_fast_as_possible());
  ASSERT_TRUE(camera->start());

  ASSERT_TRUE(camera->next(seconds(1)));
  const Result<Frame> broken = camera->next(seconds(1));

  EXPECT_EQ(broken.error().code, ErrorCode::Io);
  EXPECT_THAT(broken.error().message, HasSubstr("000001.pgm"));
  EXPECT_THAT(play(*camera), ElementsAre(Played{2, 40'000'000, 30}));
}

TEST_F(ReplayCamera, PlaysAVideo) {
  const std::string file = (root_ / "north" / "north.avi").string();
  cv::VideoWriter writer(file, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 50.0, cv::Size(64, 48), false);
  if (!writer.isOpened()) GTEST_SKIP() << "this OpenCV writes no Motion JPEG";
  for (const int grey : {40, 120, 200}) writer.write(cv::Mat(48, 64, CV_8UC1, cv::Scalar(grey)));
  writer.release();
  write_times("frame,time_ns\n10,1000\n11,2000\n13,4000\n");
  ReplaySettings settings = as_fast_as_possible();
  settings.loop = true;
  const auto camera = make_replay_camera(CameraId{0}, "north", settings);

  const Status started = camera->start();
  ASSERT_TRUE(started) << started.error().message;
  const std::vector<Played> played = play(*camera, 4);

  ASSERT_EQ(played.size(), 4U);
  const Played expected[] = {{10, 1000, 40}, {11, 2000, 120}, {13, 4000, 200}, {14, 5500, 40}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(played[i].number, expected[i].number);
    EXPECT_EQ(played[i].exposed_ns, expected[i].exposed_ns);
    EXPECT_NEAR(played[i].grey, expected[i].grey, 3);  // loss of JPEG, and full range versus studio range
  }
}

}  // namespace replay_camera_test
}  // namespace mocap::cameras
