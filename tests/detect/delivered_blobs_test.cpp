#include "detect/delivered_blobs.h"

#include <gtest/gtest.h>

namespace mocap::detect {
namespace delivered_blobs_test {

class OneBlobCamera : public BlobCamera {
 public:
  OneBlobCamera() {
    Blob blob;
    blob.centroid.v = {3.0, 4.0};
    blob.track = BlobTrackId{9};
    blobs_.push_back(blob);
  }
  Status start() override { return {}; }
  Result<Frame> next(Duration /*patience*/) override { return Frame{}; }
  void stop() noexcept override {}
  const Blobs& blobs() const override { return blobs_; }

 private:
  Blobs blobs_;
};

TEST(DeliveredBlobs, AreThoseOfTheCameraWithTheirTracks) {
  const OneBlobCamera camera;
  const auto detector = make_delivered_detector(camera);
  const auto tracker = make_delivered_tracker();

  BlobFrame frame;
  frame.blobs = detector->detect(Image{}).blobs;
  tracker->track(frame);

  ASSERT_EQ(frame.blobs.size(), 1U);
  EXPECT_EQ(frame.blobs[0].centroid.v.x(), 3.0);
  EXPECT_EQ(frame.blobs[0].track, BlobTrackId{9});
}

}  // namespace delivered_blobs_test
}  // namespace mocap::detect
