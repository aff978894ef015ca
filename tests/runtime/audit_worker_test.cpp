#include "runtime/audit_worker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

namespace mocap::runtime {
namespace audit_worker_test {

constexpr Duration kLong = std::chrono::seconds(60);

// What the writer of a test wrote; fails or waits on demand.
struct Disk {
  std::mutex mutex;
  std::vector<std::string> lines;
  std::atomic<bool> full{false};
  std::atomic<bool> hangs{false};
  std::atomic<bool> cannot_flush{false};
  std::counting_semaphore<> attempts{0};

  std::vector<std::string> read() {
    const std::lock_guard lock(mutex);
    return lines;
  }
};

class DiskWriter final : public AuditWriter {
 public:
  explicit DiskWriter(Disk& disk) : disk_(disk) {}
  Status append(const AuditEntry& entry) override {
    disk_.attempts.release();
    disk_.hangs.wait(true);
    if (disk_.full) return Error{ErrorCode::Io, "no space"};
    const std::lock_guard lock(disk_.mutex);
    disk_.lines.push_back(entry.what == "lost" ? "lost " + entry.details[0].second : entry.what);
    return {};
  }
  Status sync() override {
    if (disk_.cannot_flush) return Error{ErrorCode::Io, "cannot be flushed"};
    return {};
  }

 private:
  Disk& disk_;
};

std::string error_of(const AuditHealth& health) { return {health.error.begin(), health.error.end()}; }

TEST(AuditWorker, WritesAnOrderBeforeItReturns) {
  Disk disk;
  AuditWorker worker(std::make_unique<DiskWriter>(disk));

  worker.note({.what = "connected"});
  const bool written = worker.write({.what = "ordered"}, kLong);

  EXPECT_TRUE(written);
  EXPECT_EQ(disk.read(), (std::vector<std::string>{"connected", "ordered"}));
  EXPECT_EQ(worker.health().lines, 2U);
  EXPECT_TRUE(worker.health().on);
}

TEST(AuditWorker, DoesNotWaitForAFullDiskAndWritesLaterWithoutALoss) {
  Disk disk;
  AuditWorker worker(std::make_unique<DiskWriter>(disk));
  disk.full = true;

  EXPECT_FALSE(worker.write({.what = "one"}, kLong));
  EXPECT_FALSE(worker.write({.what = "two"}, kLong));
  EXPECT_EQ(error_of(worker.health()), "no space");
  EXPECT_EQ(worker.health().waiting, 2U);
  disk.full = false;

  EXPECT_TRUE(worker.write({.what = "three"}, kLong));
  EXPECT_EQ(disk.read(), (std::vector<std::string>{"one", "two", "three"}));
  EXPECT_EQ(error_of(worker.health()), "");
}

TEST(AuditWorker, FlushesAgainWithoutAnotherEntry) {
  Disk disk;
  AuditWorker worker(std::make_unique<DiskWriter>(disk));
  disk.cannot_flush = true;
  EXPECT_TRUE(worker.write({.what = "ordered"}, kLong));
  EXPECT_EQ(error_of(worker.health()), "cannot be flushed");

  disk.cannot_flush = false;
  const Timestamp limit = host_now() + kLong;
  while (!error_of(worker.health()).empty() && host_now() < limit)
    std::this_thread::yield();  // tried again every second

  EXPECT_EQ(error_of(worker.health()), "");
}

TEST(AuditWorker, CountsWhatIsLostWhileTheQueueIsFullAndSaysSoInTheLog) {
  Disk disk;
  AuditWorker worker(std::make_unique<DiskWriter>(disk));
  disk.full = true;

  for (std::size_t i = 0; i < AuditWorker::kMaxWaiting + 5; ++i) worker.note({.what = "connected"});
  EXPECT_EQ(worker.health().lost, 5U);
  disk.full = false;
  while (worker.health().waiting > 0) std::this_thread::yield();  // tried again every second

  EXPECT_TRUE(worker.write({.what = "ordered"}, kLong));
  const auto lines = disk.read();
  EXPECT_EQ(std::ranges::count(lines, "lost 5"), 1);
  EXPECT_EQ(std::ranges::count(lines, "connected"), static_cast<std::ptrdiff_t>(AuditWorker::kMaxWaiting));
}

TEST(AuditWorker, NeverWaitsForADiskThatHangsLongerThanThePatience) {
  Disk disk;
  disk.hangs = true;
  AuditWorker worker(std::make_unique<DiskWriter>(disk));

  worker.note({.what = "connected"});
  disk.attempts.acquire();
  EXPECT_FALSE(worker.write({.what = "ordered"}, std::chrono::milliseconds(1)));
  worker.note({.what = "disconnected"});
  worker.change(nullptr);

  EXPECT_FALSE(worker.health().on);
  disk.hangs = false;
  disk.hangs.notify_all();
}

TEST(AuditWorker, ContinuesInAnotherFile) {
  Disk before, after;
  AuditWorker worker(std::make_unique<DiskWriter>(before));
  ASSERT_TRUE(worker.write({.what = "one"}, kLong));

  worker.change(std::make_unique<DiskWriter>(after));
  ASSERT_TRUE(worker.write({.what = "two"}, kLong));

  EXPECT_EQ(before.read(), std::vector<std::string>{"one"});
  EXPECT_EQ(after.read(), std::vector<std::string>{"two"});
}

TEST(AuditWorker, WritesWhatWaitsWhenItEnds) {
  Disk disk;
  {
    AuditWorker worker(std::make_unique<DiskWriter>(disk));
    worker.note({.what = "ended"});
  }

  EXPECT_EQ(disk.read(), std::vector<std::string>{"ended"});
}

TEST(AuditWorker, DiscardsEntriesWithoutAFile) {
  AuditWorker worker(nullptr);

  EXPECT_FALSE(worker.write({.what = "ordered"}, kLong));
  EXPECT_FALSE(worker.health().on);
}

}  // namespace audit_worker_test
}  // namespace mocap::runtime
