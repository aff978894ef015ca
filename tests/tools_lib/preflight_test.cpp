#include "lib/preflight/preflight.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <vector>

namespace mocap::preflight {
namespace preflight_test {

using testing::HasSubstr;
using testing::Not;

// Four cameras at 120 Hz and one tracked subject, with nothing wrong.
PreflightFacts ready() {
  PreflightFacts facts;
  facts.description.set_nominal_rate_hz(120.0);
  for (const bool after : {false, true}) {
    v1::Status& status = after ? facts.now : facts.before;
    status.set_capturing(true);
    v1::Health& health = *status.mutable_health();
    health.set_sets(after ? 1240 : 1000);
    health.set_complete_sets(after ? 1239 : 999);
    health.set_set_rate_hz(120.0);
    auto* total = health.add_latencies();
    total->set_stage(v1::LATENCY_STAGE_TOTAL);
    total->set_p99_ns(9'000'000);
    for (const char* name : {"north", "east", "south", "west"}) {
      v1::CameraHealth& camera = *health.add_cameras();
      camera.set_name(name);
      camera.set_phase(v1::CAMERA_PHASE_STREAMING);
      camera.set_rate_hz(119.9);
      camera.set_missing_frames(7);
      camera.set_synchronised(true);
      camera.set_background_grey(8.0);
      camera.set_fused_blobs(1000);
      camera.set_marker_blobs(950);
    }
    health.mutable_feed()->set_listeners(1);
    auto* subject = status.add_subjects();
    subject->set_name("anna");
    subject->set_phase(v1::SUBJECT_PHASE_TRACKING);
  }
  facts.free_minutes = 600.0;
  facts.calibration_age_days = 2.0;
  return facts;
}

TEST(Preflight, FindsNothingWrongWhenAllIsWell) {
  for (const Finding& finding : examine_daemon(ready()))
    EXPECT_EQ(finding.verdict, Verdict::Good) << finding.check << ": " << finding.what;
}

TEST(Preflight, TellsTheMinutesOfTakesThatFitOnTheDisk) {
  const std::vector<Finding> findings = examine_daemon(ready());

  const auto disk = std::ranges::find(findings, "disk", &Finding::check);
  ASSERT_NE(disk, findings.end());
  EXPECT_EQ(disk->minutes, 600.0);
  EXPECT_THAT(json_of({*disk}), HasSubstr("\"minutes\":600.0"));
  EXPECT_THAT(json_of({good("sets", "all")}), Not(HasSubstr("minutes")));
}

TEST(Preflight, JudgesEachCameraByItsOwnRate) {
  PreflightFacts facts = ready();
  for (const char* name : {"north", "east"}) facts.description.add_cameras()->set_name(name);
  facts.description.mutable_cameras(1)->set_nominal_rate_hz(60.0);
  v1::CameraHealth& slow = *facts.now.mutable_health()->mutable_cameras(1);
  const auto verdict = [&] {
    const std::vector<Finding> findings = examine_daemon(facts);
    return std::ranges::find(findings, "camera east", &Finding::check)->verdict;
  };

  slow.set_rate_hz(59.9);
  EXPECT_EQ(verdict(), Verdict::Good);
  slow.set_rate_hz(50.0);
  EXPECT_EQ(verdict(), Verdict::Bad);
}

TEST(Preflight, JudgesNoCameraOfUnknownRateByTheRateOfAnother) {
  PreflightFacts facts = ready();
  facts.now.mutable_health()->mutable_cameras(1)->set_rate_hz(30.0);
  for (const char* name : {"north", "east"}) facts.description.add_cameras()->set_name(name);
  const auto verdict = [&] {
    const std::vector<Finding> findings = examine_daemon(facts);
    return std::ranges::find(findings, "camera east", &Finding::check)->verdict;
  };

  EXPECT_EQ(verdict(), Verdict::Bad) << "no camera has a rate: that of the description applies";
  facts.description.mutable_cameras(0)->set_nominal_rate_hz(120.0);
  EXPECT_EQ(verdict(), Verdict::Good);
}

struct Fault {
  const char* name;
  std::function<void(PreflightFacts&)> plant;
  const char* check;
  Verdict verdict;
  const char* cure;
};

v1::CameraHealth& east(PreflightFacts& facts) { return *facts.now.mutable_health()->mutable_cameras(1); }

const Fault kFaults[] = {
    {"the cameras are stopped", [](PreflightFacts& f) { f.now.set_capturing(false); }, "capture", Verdict::Bad,
     "mocapctl capture start"},
    {"a camera is lost", [](PreflightFacts& f) { east(f).set_phase(v1::CAMERA_PHASE_REOPENING); }, "camera east",
     Verdict::Bad, "mocapctl cameras list"},
    {"a camera moved", [](PreflightFacts& f) { east(f).set_bumped(true); }, "camera east", Verdict::Bad,
     "mocap-calibrate refine"},
    {"a clock lost PTP", [](PreflightFacts& f) { east(f).set_clock_source(v1::CLOCK_SOURCE_LOST); }, "camera east",
     Verdict::Bad, "PTP"},
    {"a camera runs free", [](PreflightFacts& f) { east(f).set_synchronised(false); }, "camera east", Verdict::Bad,
     "trigger"},
    {"a camera is slow", [](PreflightFacts& f) { east(f).set_rate_hz(60.0); }, "camera east", Verdict::Bad,
     "mocapctl doctor"},
    {"images get lost", [](PreflightFacts& f) { east(f).set_missing_frames(8); }, "camera east", Verdict::Bad,
     "mocapctl doctor"},
    {"images are dropped", [](PreflightFacts& f) { east(f).set_dropped_queue_full(1); }, "camera east", Verdict::Bad,
     "mocapctl doctor"},
    {"the exposure is too long", [](PreflightFacts& f) { east(f).set_background_grey(90.0); }, "camera east",
     Verdict::Warning, "--exposure-us"},
    {"a camera does not fit the rig", [](PreflightFacts& f) { east(f).set_marker_blobs(10); }, "camera east",
     Verdict::Warning, "mocap-calibrate verify"},
    {"sets are skipped", [](PreflightFacts& f) { f.now.mutable_health()->set_passed_over_sets(3); }, "sets",
     Verdict::Bad, "mocapctl doctor"},
    {"no sets come", [](PreflightFacts& f) { f.now.mutable_health()->set_sets(1000); }, "sets", Verdict::Bad,
     "mocapctl status"},
    {"sets are incomplete", [](PreflightFacts& f) { f.now.mutable_health()->set_complete_sets(1100); }, "sets",
     Verdict::Warning, "mocapctl status"},
    {"snapshots are late",
     [](PreflightFacts& f) { f.now.mutable_health()->mutable_latencies(0)->set_p99_ns(90'000'000); }, "latency",
     Verdict::Warning, "[realtime]"},
    {"a subject is searched for",
     [](PreflightFacts& f) { f.now.mutable_subjects(0)->set_phase(v1::SUBJECT_PHASE_SEARCHING); }, "subject anna",
     Verdict::Warning, "mocapctl subject"},
    {"a subscriber is slow", [](PreflightFacts& f) { f.now.mutable_health()->mutable_feed()->set_behind(1); },
     "subscribers", Verdict::Warning, "network"},
    {"the disk is full", [](PreflightFacts& f) { f.free_minutes = 4.0; }, "disk", Verdict::Bad, "old takes"},
    {"the disk is nearly full", [](PreflightFacts& f) { f.free_minutes = 20.0; }, "disk", Verdict::Warning,
     "old takes"},
    {"the calibration is old", [](PreflightFacts& f) { f.calibration_age_days = 40.0; }, "calibration",
     Verdict::Warning, "mocap-calibrate verify"},
    {"the last take failed",
     [](PreflightFacts& f) { f.now.mutable_health()->mutable_take()->set_state(v1::TAKE_STATE_FAILED); }, "last take",
     Verdict::Warning, "mocapctl take show"},
    {"a recording failed",
     [](PreflightFacts& f) {
       auto* recording = f.now.mutable_health()->add_recordings();
       recording->set_path("a.jsonl");
       recording->set_state(v1::RECORDING_STATE_FAILED);
     },
     "recording a.jsonl", Verdict::Bad, "mocapctl reload"},
};

TEST(Preflight, NamesEachPlantedFaultAloneWithItsCure) {
  for (const Fault& fault : kFaults) {
    PreflightFacts facts = ready();
    fault.plant(facts);

    std::vector<Finding> wrong;
    for (const Finding& finding : examine_daemon(facts)) {
      if (finding.verdict != Verdict::Good) wrong.push_back(finding);
    }

    ASSERT_EQ(wrong.size(), 1U) << fault.name;
    EXPECT_EQ(wrong[0].check, fault.check) << fault.name;
    EXPECT_EQ(wrong[0].verdict, fault.verdict) << fault.name;
    EXPECT_THAT(wrong[0].cure, HasSubstr(fault.cure)) << fault.name;
    EXPECT_EQ(is_bad(wrong), fault.verdict == Verdict::Bad) << fault.name;
  }
}

TEST(Preflight, ToleratesADaemonThatSaysLittle) {
  EXPECT_TRUE(is_bad(examine_daemon({})));
  PreflightFacts facts;
  facts.now.set_capturing(true);
  EXPECT_TRUE(is_bad(examine_daemon(facts)));
  facts.now.mutable_health();
  EXPECT_FALSE(examine_daemon(facts).empty());
}

}  // namespace preflight_test
}  // namespace mocap::preflight
