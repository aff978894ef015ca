#include <gtest/gtest.h>

#include <atomic>
#include <memory>

#include "assemble.h"
#include "base/wake_signal.h"
#include "cameras/synthetic/synthetic_settings.h"
#include "scene/ring_rig.h"
#include "settings/subject/marker_set_file.h"
#include "support/allocation_counter.h"
#include "support/places.h"

namespace mocap {
namespace steady_state_test {

constexpr int kCameras = 4;
constexpr std::uint64_t kWarmUpSets = 300;     // the subject is identified in its T-pose and starts to walk
constexpr std::uint64_t kMeasuredSets = 2500;  // of four cameras: 10,000 frames

// The real publisher; starts and stops the count of allocations by the number of sets.
class CountingPublisher : public Publisher {
 public:
  struct Seen {
    std::atomic<bool> through{false};
    WakeSignal changed;
    support::AllocationCount allocations;
    std::uint64_t labelled = 0;
  };

  CountingPublisher(std::unique_ptr<Publisher> real, Seen& seen) : real_(std::move(real)), seen_(seen) {}

  Status describe(const Description& description) override { return real_->describe(description); }
  Status report(const Health& health) override { return real_->report(health); }

  Status publish(Snapshot& snapshot) override {
    ++sets_;
    if (sets_ == kWarmUpSets) support::start_counting_allocations();
    if (sets_ == kWarmUpSets + kMeasuredSets) {
      seen_.allocations = support::stop_counting_allocations();
      seen_.through = true;
      seen_.changed.signal();
    }
    for (const SubjectLabels& subject : snapshot.labels) {
      for (const LabelledMarker& marker : subject.markers) seen_.labelled += marker.state == LabelState::Measured;
    }
    return real_->publish(snapshot);
  }

 private:
  std::unique_ptr<Publisher> real_;
  Seen& seen_;
  std::uint64_t sets_ = 0;
};

settings::DaemonSettings fast_synthetic_daemon(const MarkerSet& worn) {
  settings::DaemonSettings settings;
  settings.rig = scene::ring_rig({.cameras = kCameras});
  for (const CameraModel& camera : settings.rig) {
    cameras::SyntheticSettings synthetic;
    synthetic.speed = 0.0;
    settings.cameras.push_back({camera.name, synthetic});
    settings.simulated.push_back(worn);
  }
  settings.subjects.push_back({"subject", {}, {}, {}});
  settings.subject_models.push_back({"subject", worn});
  settings.publish.endpoint = "tcp://127.0.0.1:*";
  settings.pipeline.publish.report_every =
      std::chrono::milliseconds(20);  // so that many reports are measured, except the first one
  return settings;
}

TEST(SteadyState, DoesNotAllocateInTenThousandFrames) {
  if (!support::allocations_can_be_counted()) GTEST_SKIP() << "the sanitizer owns the heap";
  const auto worn = settings::load_marker_set(support::source_folder() + "/config/markersets/openmocap18.toml");
  ASSERT_TRUE(worn) << worn.error().message;
  const settings::DaemonSettings settings = fast_synthetic_daemon(*worn);
  Result<Assembly> assembly = assemble(settings);
  ASSERT_TRUE(assembly) << assembly.error().message;
  CountingPublisher::Seen seen;
  assembly->parts.publisher = std::make_unique<CountingPublisher>(std::move(assembly->parts.publisher), seen);

  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(assembly->parts));
  const Timestamp limit = host_now() + std::chrono::seconds(100);
  while (!seen.through && host_now() < limit) {
    const WakeSignal::Ticket ticket = seen.changed.ticket();
    if (!seen.through) seen.changed.wait(ticket, std::chrono::seconds(1));
  }
  pipeline.stop();

  ASSERT_TRUE(seen.through);
  EXPECT_GT(seen.labelled, kMeasuredSets * 10);  // the pipeline did label markers
  EXPECT_EQ(seen.allocations.by_new, 0U);
  EXPECT_EQ(seen.allocations.by_malloc, 0U);
}

}  // namespace steady_state_test
}  // namespace mocap
