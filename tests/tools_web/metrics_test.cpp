#include "web/metrics/metrics.h"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>

#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "web/metrics/metric_table.h"

namespace mocap::web {
namespace metrics_test {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using testing::HasSubstr;

v1::Health full_health() {
  v1::Health health;
  health.set_sets(7200);
  auto* total = health.add_latencies();
  total->set_stage(v1::LATENCY_STAGE_TOTAL);
  total->set_p50_ns(8'000'000);
  for (const double bound_s : {0.001, 0.01}) health.add_latency_bounds_s(bound_s);
  auto* totals = health.add_latency_totals();
  totals->set_stage(v1::LATENCY_STAGE_TOTAL);
  for (const std::uint64_t count : {2U, 3U, 5U}) totals->add_counts(count);
  totals->set_sum_s(0.5);
  for (const char* name : {"north", "a \"quoted\" \\ name"}) {
    auto* camera = health.add_cameras();
    camera->set_name(name);
    camera->set_frames(100);
    camera->set_phase(v1::CAMERA_PHASE_STREAMING);
    camera->set_offset_us(250.0);
  }
  health.mutable_feed()->set_listeners(3);
  health.add_recordings()->set_path("/var/lib/a.mocapblobs");
  health.mutable_take()->set_state(v1::TAKE_STATE_RECORDING);
  health.add_searches()->set_subject(1);
  return health;
}

v1::Description two_subjects() {
  v1::Description description;
  description.add_subjects()->set_name("anna");
  description.add_subjects()->set_name("bert");
  return description;
}

// Names of numeric fields that are no metrics: times and the index of a subject.
const std::set<std::string> kNoMetrics = {"at_ns", "utc_minus_host_ns", "latency_bounds_s"};

TEST(Metrics, HaveEveryNumberOfHealth) {
  for (const Descriptor* message :
       {v1::Health::descriptor(), v1::CameraHealth::descriptor(), v1::FeedHealth::descriptor(),
        v1::TakeHealth::descriptor(), v1::RecordingHealth::descriptor(), v1::StageLatency::descriptor()}) {
    for (int i = 0; i < message->field_count(); ++i) {
      const FieldDescriptor& field = *message->field(i);
      const bool number = field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE &&
                          field.cpp_type() != FieldDescriptor::CPPTYPE_STRING &&
                          field.cpp_type() != FieldDescriptor::CPPTYPE_ENUM;
      if (number && !kNoMetrics.contains(field.name())) {
        EXPECT_TRUE(is_metric(message->name(), field.name()))
            << "metric_table.cpp lacks " << message->name() << '.' << field.name();
      }
    }
  }
}

TEST(Metrics, FollowThePrometheusTextFormat) {
  const v1::Health health = full_health();
  const v1::Description description = two_subjects();
  const std::string text = metrics_text({true, 0.5, &health, &description, {.refused = {{"flood", 2}}}});

  const std::regex sample(
      R"re(([a-z_0-9]+)(\{([a-z]+="([^"\\\n]|\\["\\n])*",?)+\})? (-?[0-9.]+(e[-+]?[0-9]+)?|nan|-?inf))re");
  std::istringstream lines(text);
  std::string family;
  std::set<std::string> families;
  std::set<std::string> samples;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# HELP ")) {
      family = line.substr(7, line.find(' ', 7) - 7);
      EXPECT_TRUE(families.insert(family).second) << family << " occurs twice";
      EXPECT_TRUE(line.ends_with('.')) << line;
    } else if (line.starts_with("# TYPE ")) {
      EXPECT_TRUE(line.starts_with("# TYPE " + family + ' ')) << line;
      EXPECT_EQ(line.ends_with(" counter"), family.ends_with("_total")) << line;
    } else {
      std::smatch parts;
      ASSERT_TRUE(std::regex_match(line, parts, sample)) << line;
      EXPECT_TRUE(parts[1] == family || (family == "mocap_latency_seconds" && parts[1].str().starts_with(family + '_')))
          << line;
      EXPECT_TRUE(samples.insert(line.substr(0, line.rfind(' '))).second) << line;
    }
  }
}

TEST(Metrics, AreInBaseUnits) {
  const v1::Health health = full_health();

  const std::string text = metrics_text({true, 0.5, &health, nullptr, {}});

  EXPECT_THAT(text, HasSubstr("\nmocap_latency_median_seconds{stage=\"total\"} 0.008\n"));
  EXPECT_THAT(text, HasSubstr("mocap_camera_exposure_offset_seconds{camera=\"north\"} 0.00025\n"));
  EXPECT_THAT(text, HasSubstr("mocap_camera_frames_total{camera=\"a \\\"quoted\\\" \\\\ name\"} 100\n"));
  EXPECT_THAT(text, HasSubstr("mocap_take_recording 1\n"));
}

TEST(Metrics, HaveHistogramsOfTheLatency) {
  const v1::Health health = full_health();

  const std::string text = metrics_text({true, 0.5, &health, nullptr, {}});

  EXPECT_THAT(text, HasSubstr("# TYPE mocap_latency_seconds histogram\n"
                              "mocap_latency_seconds_bucket{stage=\"total\",le=\"0.001\"} 2\n"
                              "mocap_latency_seconds_bucket{stage=\"total\",le=\"0.01\"} 5\n"
                              "mocap_latency_seconds_bucket{stage=\"total\",le=\"+Inf\"} 10\n"
                              "mocap_latency_seconds_sum{stage=\"total\"} 0.5\n"
                              "mocap_latency_seconds_count{stage=\"total\"} 10\n"));
}

TEST(Metrics, OmitAbsentFields) {
  const v1::Health health = full_health();

  EXPECT_THAT(metrics_text({true, 0.5, &health, nullptr, {}}), testing::Not(HasSubstr("mocap_camera_noise_grey{")));
}

TEST(Metrics, NameTheSubjectsThatAreSearchedFor) {
  const v1::Health health = full_health();
  const v1::Description description = two_subjects();

  const std::string text = metrics_text({true, 0.5, &health, &description, {}});

  EXPECT_THAT(text, HasSubstr("mocap_subject_searched{subject=\"anna\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("mocap_subject_searched{subject=\"bert\"} 1\n"));
}

TEST(Metrics, SayThatTheDaemonIsGone) {
  const std::string text = metrics_text({});

  EXPECT_THAT(text, HasSubstr("mocap_up 0\n"));
  EXPECT_THAT(text, testing::Not(HasSubstr("mocap_camera")));
}

}  // namespace metrics_test
}  // namespace mocap::web
