#include "web/takes/exports.h"

#include <gtest/gtest.h>

#include <future>
#include <mutex>
#include <thread>

#include "support/temporary_folder.h"

namespace mocap::web {
namespace exports_test {

constexpr auto kLong = std::chrono::seconds(60);  // time limit of a failing test

// Functions for the thread of the test, which runs them in `run_all`.
class Loop {
 public:
  Exports::RunHere run_here() {
    return [this](std::function<void()> work) {
      const std::lock_guard lock(mutex_);
      waiting_.push_back(std::move(work));
      came_.notify_one();
    };
  }
  void run_until(const std::function<bool()>& holds) {
    while (!holds()) {
      std::unique_lock lock(mutex_);
      ASSERT_TRUE(came_.wait_for(lock, kLong, [this] { return !waiting_.empty(); }));
      const auto work = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      work();
    }
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<std::function<void()>> waiting_;
};

TEST(Exports, RunsAWishOnceAndKeepsTheFile) {
  const support::TemporaryFolder folder;
  const auto path = folder.write("walk.c3d", "c3d");
  Loop loop;
  int runs = 0;
  Exports exports(
      [&](const ExportWish& wish, std::atomic<double>& progress, const std::atomic<bool>&) {
        ++runs;
        progress = 1.0;
        EXPECT_EQ(wish.format, "c3d");
        return OpenFile::open(path);
      },
      loop.run_here());

  const auto job = exports.wish("a", {"walk.mcap", "c3d", {}});
  bool told = false;
  job->waiting.emplace_back([&](const ExportJob& ended) { told = ended.file != nullptr; });
  loop.run_until([&] { return job->state == ExportState::Done; });

  EXPECT_TRUE(told);
  EXPECT_EQ(job->file->size(), 3U);
  EXPECT_EQ(exports.wish("a", {"walk.mcap", "c3d", {}}), job);
  EXPECT_EQ(runs, 1);
}

TEST(Exports, ReturnsAFaultOnceAndThenTriesAgain) {
  Loop loop;
  Exports exports(
      [](const ExportWish&, std::atomic<double>&, const std::atomic<bool>&) -> Result<std::shared_ptr<OpenFile>> {
        return Error{ErrorCode::InvalidArgument, "the take is empty"};
      },
      loop.run_here());
  const auto job = exports.wish("a", {});
  loop.run_until([&] { return job->state == ExportState::Failed; });

  EXPECT_EQ(exports.wish("a", {})->fault, "the take is empty");
  EXPECT_NE(exports.wish("a", {}), job);
}

TEST(Exports, EndsTheExportThatRunsAndBeginsNoOther) {
  std::promise<void> begun;
  int left_files = 0, runs = 0;
  Exports exports(
      [&](const ExportWish&, std::atomic<double>&,
          const std::atomic<bool>& stopped) -> Result<std::shared_ptr<OpenFile>> {
        ++runs;
        ++left_files;
        begun.set_value();
        while (!stopped) std::this_thread::yield();
        --left_files;
        return Error{ErrorCode::Io, "stopped"};
      },
      [](const std::function<void()>&) {});
  ASSERT_NE(exports.wish("a", {}), nullptr);
  ASSERT_NE(exports.wish("b", {}), nullptr);
  ASSERT_EQ(begun.get_future().wait_for(kLong), std::future_status::ready);

  exports.stop();

  EXPECT_EQ(left_files, 0);
  EXPECT_EQ(runs, 1);
}

TEST(Exports, BoundsWhatWaits) {
  std::promise<void> end;
  const std::shared_future<void> ended = end.get_future();
  Loop loop;
  Exports exports(
      [&](const ExportWish&, std::atomic<double>&, const std::atomic<bool>&) -> Result<std::shared_ptr<OpenFile>> {
        ended.wait();
        return Error{ErrorCode::Io, "ended"};
      },
      loop.run_here());

  std::shared_ptr<ExportJob> first;
  for (std::size_t i = 0; i < kMaxExports; ++i) {
    const auto job = exports.wish(std::to_string(i), {});
    ASSERT_NE(job, nullptr);
    if (i == 0) first = job;
  }

  EXPECT_EQ(exports.wish("one more", {}), nullptr);
  end.set_value();
  loop.run_until([&] { return first->state == ExportState::Failed; });
  EXPECT_NE(exports.wish("one more", {}), nullptr);
}

}  // namespace exports_test
}  // namespace mocap::web
