// Takes whose recording is stopped: by kill -9 at a random instant, by a limit of the file size, and by a full disk.
#include <gmock/gmock.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <random>

#include "support/file_size_limit.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/take_edit.h"
#include "take/take_reader.h"
#include "take/take_writer.h"

namespace mocap::take {
namespace take_crash_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr auto kAllowedLoss = std::chrono::milliseconds(100);

// Memory that a child process shares with the test.
class SharedCount {
 public:
  SharedCount() {
    void* page =
        ::mmap(nullptr, sizeof(std::atomic<std::uint64_t>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    count_ = new (page) std::atomic<std::uint64_t>(0);
  }
  SharedCount(const SharedCount&) = delete;
  SharedCount& operator=(const SharedCount&) = delete;
  ~SharedCount() { ::munmap(count_, sizeof *count_); }
  std::atomic<std::uint64_t>& operator*() { return *count_; }

 private:
  std::atomic<std::uint64_t>* count_;
};

// Records sets without end; `recorded` counts the sets that were appended.
[[noreturn]] void record_until_killed(const std::filesystem::path& path, bool sync,
                                      std::atomic<std::uint64_t>& recorded) {
  mcap::WriterSettings settings;
  settings.sync = sync;
  auto writer = TakeWriter::create(path, example_start(), settings);
  for (std::uint64_t set = 0; writer; ++set) {
    if (!append_example(**writer, set, set + 1)) break;
    recorded = set + 1;
  }
  ::_exit(1);
}

TEST(TakeCrash, AKilledRecordingMissesAtMostTheLast100Ms) {
  std::mt19937 random(11);
  std::uint64_t most_lost = 0;
  constexpr int kRounds = support::kSanitized ? 60 : 200;
  for (int round = 0; round < kRounds; ++round) {
    const support::TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "take.mcap";
    SharedCount recorded;
    const std::uint64_t until = random() % 120;
    const auto more_us = static_cast<useconds_t>(random() % 2000);
    const pid_t child = ::fork();
    if (child == 0) record_until_killed(path, round % 8 == 0, *recorded);
    int status = 0;
    while (*recorded < until && ::waitpid(child, &status, WNOHANG) == 0) ::usleep(50);
    ::usleep(more_us);
    ::kill(child, SIGKILL);
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    if (*recorded == 0) continue;  // killed before the take began

    const auto reader = TakeReader::open(path);

    ASSERT_TRUE(reader) << round << ": " << reader.error().message;
    EXPECT_TRUE(reader->cut_off());
    EXPECT_FALSE(reader->is_being_written());
    const ExampleContent content = read_example(*reader);
    ASSERT_EQ(content.wrong + content.errors, 0U) << round << ": " << content.first_error;
    ASSERT_TRUE(content.has_no_gap()) << round;
    const auto lost =
        static_cast<std::uint64_t>(*recorded) - std::min<std::uint64_t>(*recorded, content.snapshots.size());
    most_lost = std::max(most_lost, lost);
    ASSERT_LE(lost * kExamplePeriod_ns, static_cast<std::uint64_t>(Duration(kAllowedLoss).count())) << round;
    if (round % 10 != 0) continue;
    ASSERT_TRUE(repair_take(path));
    ASSERT_THAT(*verify_take(path), IsEmpty());
  }
  RecordProperty("most_lost_ms", std::to_string(1e-6 * static_cast<double>(most_lost * kExamplePeriod_ns)));
}

TEST(TakeCrash, AFileSizeLimitEndsTheFileWithItsLastWholeChunk) {
  const support::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "take.mcap";
  auto writer = TakeWriter::create(path, example_start());
  ASSERT_TRUE(writer);
  Status failed, again, finished;
  {
    const support::FileSizeLimit full_disk(150'000);
    failed = append_example(**writer, 0, 10'000);
    again = (*writer)->append(example_snapshot(10'000));
    finished = (*writer)->finish(example_end(10'000));
  }

  const auto reader = TakeReader::open(path);

  ASSERT_FALSE(failed);
  EXPECT_THAT(failed.error().message, HasSubstr("take.mcap"));
  EXPECT_EQ(again.error().message, failed.error().message);
  EXPECT_FALSE(finished);
  ASSERT_TRUE(reader) << reader.error().message;
  const ExampleContent content = read_example(*reader);
  EXPECT_EQ(content.wrong + content.errors, 0U) << content.first_error;
  EXPECT_TRUE(content.has_no_gap());
  EXPECT_GT(content.snapshots.size(), 20U);
  EXPECT_EQ(std::filesystem::file_size(path), (*writer)->size().bytes);
  writer->reset();
  EXPECT_TRUE(repair_take(path));
  EXPECT_THAT(*verify_take(path), IsEmpty());
}

constexpr int kNoMount = 77;

// Fills a file system of 1 MB. Returns the exit code: 0, kNoMount, or the number of the step that failed.
int record_on_a_full_disk(const std::filesystem::path& folder) {
  const bool mounted = (::geteuid() == 0 ? ::unshare(CLONE_NEWNS) : ::unshare(CLONE_NEWUSER | CLONE_NEWNS)) == 0 &&
                       ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
                       ::mount("tmpfs", folder.c_str(), "tmpfs", 0, "size=1m") == 0;
  if (!mounted) return kNoMount;
  const std::filesystem::path path = folder / "take.mcap";
  auto writer = TakeWriter::create(path, example_start());
  if (!writer) return 1;
  const Status failed = append_example(**writer, 0, 100'000);
  if (failed) return 2;
  TakeInfo end = example_end(100'000);
  add_quality(end, crowd_report(kMaxSubjects), "the disk is full");
  const Status finished = (*writer)->finish(end);
  if (finished || finished.error().message != failed.error().message) return 3;
  const auto reader = TakeReader::open(path);
  if (!reader) return 4;
  // The file is complete: the space of the index was reserved.
  if (reader->cut_off() || !reader->info().ended_at || !reader->info().others.contains("quality")) return 5;
  const ExampleContent content = read_example(*reader);
  if (content.wrong + content.errors > 0 || !content.has_no_gap() || content.snapshots.size() < 50) return 6;
  if (!verify_take(path)->empty()) return 7;
  // The disk has no space for longer notes; the file stays as it is.
  TakeEdit edit;
  edit.notes = std::string(10'000, 'n');
  while (edit_take(path, edit)) continue;
  return verify_take(path)->empty() ? 0 : 8;
}

TEST(TakeCrash, AFullDiskEndsTheTakeWithItsIndex) {
  const support::TemporaryFolder folder;
  const pid_t child = ::fork();
  if (child == 0) ::_exit(record_on_a_full_disk(folder.path()));
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);

  if (WIFEXITED(status) && WEXITSTATUS(status) == kNoMount) GTEST_SKIP() << "a file system cannot be mounted here";
  EXPECT_TRUE(WIFEXITED(status)) << status;
  EXPECT_EQ(WEXITSTATUS(status), 0) << "step of record_on_a_full_disk";
}

}  // namespace take_crash_test
}  // namespace mocap::take
