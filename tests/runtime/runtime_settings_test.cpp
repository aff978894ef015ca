#include "runtime/runtime_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::runtime {
namespace runtime_settings_test {

// Checks the keys of a pipeline in all five sections.
std::vector<KeyFault> value_faults_of(PipelineSettings pipeline) {
  KeyCheck check;
  declare_capture_keys(check, pipeline);
  declare_publish_keys(check, pipeline);
  declare_reopen_keys(check, pipeline);
  declare_queues_keys(check, pipeline);
  declare_realtime_keys(check, pipeline);
  return check.faults();
}

TEST(PipelineSettings, HaveDefaultsWithinTheirRanges) { EXPECT_TRUE(value_faults_of({}).empty()); }

TEST(PipelineSettings, RejectAPriorityThatTheKernelDoesNotHave) {
  PipelineSettings pipeline;
  pipeline.fusion.thread.fifo_priority = 100;

  ASSERT_EQ(value_faults_of(pipeline).size(), 1U);
  EXPECT_EQ(value_faults_of(pipeline)[0].message, "fusion_fifo_priority is 100, expected 0 to 99");
}

TEST(PipelineSettings, GiveThePublishThreadTheWaitModeOfTheFusionThread) {
  PipelineSettings pipeline;
  pipeline.fusion.waiting = Waiting::Spin;
  KeyCheck check;

  declare_realtime_keys(check, pipeline);

  EXPECT_EQ(pipeline.publish.waiting, Waiting::Spin);
}

TEST(PipelineSettings, RejectAFirstBackoffAboveTheMaximum) {
  PipelineSettings pipeline;
  EXPECT_TRUE(reopen_faults_of(pipeline).empty());

  pipeline.camera.first_backoff = std::chrono::milliseconds(3000);

  ASSERT_EQ(reopen_faults_of(pipeline).size(), 1U);
  EXPECT_EQ(reopen_faults_of(pipeline)[0].message, "first_backoff_ms is 3000, over longest_backoff_ms = 2000");
}

}  // namespace runtime_settings_test
}  // namespace mocap::runtime
