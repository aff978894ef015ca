#include <gtest/gtest.h>
#include <pthread.h>

#include <cmath>
#include <memory>
#include <random>
#include <thread>

#include "support/allocation_counter.h"
#include "track2d/following_blob_tracker.h"

namespace mocap::assembly {
namespace track_blobs_allocation_test {

/// Moving blobs that meet, merge, disappear and come back.
void fill(BlobFrame& frame, int image, std::mt19937& random) {
  frame.exposed_at = from_ns(1) + from_s(image / 100.0);
  frame.blobs.clear();
  for (int i = 0; i < 60; ++i) {
    if (random() % 20 == 0) continue;
    Blob blob;
    blob.centroid = {{300.0 + 150.0 * std::sin(0.03 * image + i), 200.0 + 150.0 * std::sin(0.05 * image + 2.0 * i)}};
    blob.sigma_px = 0.05;
    blob.area_px2 = 100.0 + static_cast<double>(random() % 100);
    blob.roundness = 0.5 + 0.005 * static_cast<double>(random() % 100);
    blob.axis_rad = 0.3;
    frame.blobs.push_back(blob);
  }
}

TEST(TrackBlobs, DoesNotAllocateAfterConstruction) {
  if (!support::allocations_can_be_counted()) GTEST_SKIP() << "the sanitizer owns the heap";
  for (const track2d::TrackMethod method : {track2d::TrackMethod::AlphaBeta, track2d::TrackMethod::AdaptiveAlphaBeta,
                                            track2d::TrackMethod::Kalman, track2d::TrackMethod::Condensation}) {
    track2d::TrackBlobsSettings settings;
    settings.method = method;
    const auto tracker = track2d::make_blob_tracker(settings);
    const auto frame = std::make_unique<BlobFrame>();
    support::AllocationCount count;
    std::thread thread([&] {
      pthread_setname_np(pthread_self(),
                         "mocap-camera");  // the counter counts only in threads with names of the daemon's threads
      std::mt19937 random(3);
      support::start_counting_allocations();
      for (int image = 0; image < 400; ++image) {
        fill(*frame, image, random);
        tracker->track(*frame);
      }
      count = support::stop_counting_allocations();
    });
    thread.join();

    EXPECT_EQ(count.by_new, 0U);
    EXPECT_EQ(count.by_malloc, 0U);
  }
}

}  // namespace track_blobs_allocation_test
}  // namespace mocap::assembly
