#include "detect/delivered_blobs.h"

namespace mocap::detect {
namespace {

class DeliveredDetector : public Detector {
 public:
  explicit DeliveredDetector(const BlobCamera& camera) : camera_(camera) {}
  Detection detect(const Image& /*image*/) override {
    Detection detection;
    detection.blobs = camera_.blobs();
    return detection;
  }

 private:
  const BlobCamera& camera_;
};

class DeliveredTracker : public BlobTracker {
 public:
  void track(BlobFrame& /*frame*/) override {}
};

}  // namespace

std::unique_ptr<Detector> make_delivered_detector(const BlobCamera& camera) {
  return std::make_unique<DeliveredDetector>(camera);
}

std::unique_ptr<BlobTracker> make_delivered_tracker() { return std::make_unique<DeliveredTracker>(); }

}  // namespace mocap::detect
