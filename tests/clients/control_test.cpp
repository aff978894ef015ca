// Tests of health, events, requests and answers in the C library, without a connection.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "clients/messages.h"
#include "decode.h"
#include "encode_request.h"
#include "feed.h"
#include "mocap/v1/control.pb.h"
#include "mocap/v1/event.pb.h"
#include "mocap/v1/health.pb.h"
#include "text.h"

namespace mocap::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::Health health() {
  v1::Health said;
  said.set_at_ns(7);
  said.set_set_rate_hz(100.5);
  said.set_sets(9);
  v1::CameraHealth& north = *said.add_cameras();
  north.set_name("north");
  north.set_phase(v1::CAMERA_PHASE_STREAMING);
  north.set_frames(42);
  north.set_bumped(true);
  north.set_rig_off_px(3.5);
  said.add_cameras()->set_last_error("power?");
  v1::StageLatency& total = *said.add_latencies();
  total.set_stage(v1::LATENCY_STAGE_TOTAL);
  total.set_p99_ns(5);
  v1::RecordingHealth& recording = *said.add_recordings();
  recording.set_path("take.jsonl");
  recording.set_state(v1::RECORDING_STATE_FAILED);
  recording.set_error("disk full");
  said.mutable_feed()->set_listeners(3);
  return said;
}

Feed feed_of() { return Feed({"tcp://127.0.0.1:5570", "snapshot", MOCAP_AXES_MOCAP, 1, 1}); }

v1::Event event(v1::EventKind kind, std::uint64_t sequence) {
  v1::Event said;
  said.set_kind(kind);
  said.set_sequence(sequence);
  return said;
}

TEST(ClientHealth, HasAllFieldsAndTellsUnknownFromZero) {
  Feed feed = feed_of();
  EXPECT_EQ(feed.health(), nullptr);
  feed.take(testing::envelope("health", health()), {});
  const mocap_health handle{feed.health()};

  mocap_health_info info;
  ASSERT_EQ(mocap_health_get_info(&handle, &info, sizeof info), 1);
  EXPECT_EQ(info.sets, 9U);
  EXPECT_DOUBLE_EQ(info.set_rate_hz, 100.5);
  EXPECT_EQ(info.utc_minus_host_ns, MOCAP_ABSENT);
  EXPECT_EQ(info.has_feed, 1);
  EXPECT_EQ(info.listeners, 3U);

  mocap_camera_health north, other;
  ASSERT_EQ(mocap_health_get_camera(&handle, 0, &north, sizeof north), 1);
  ASSERT_EQ(mocap_health_get_camera(&handle, 1, &other, sizeof other), 1);
  EXPECT_STREQ(north.name, "north");
  EXPECT_EQ(north.phase, MOCAP_CAMERA_STREAMING);
  EXPECT_EQ(north.frames, 42U);
  EXPECT_EQ(north.bumped, 1);
  EXPECT_DOUBLE_EQ(north.rig_off_px, 3.5);
  EXPECT_STREQ(other.last_error, "power?");
  EXPECT_EQ(other.bumped, -1);
  EXPECT_TRUE(std::isnan(other.rig_off_px));
  EXPECT_EQ(mocap_health_get_camera(&handle, 2, &other, sizeof other), 0);

  mocap_latency latency;
  ASSERT_EQ(mocap_health_get_latency(&handle, 0, &latency, sizeof latency), 1);
  EXPECT_EQ(latency.stage, MOCAP_STAGE_TOTAL);
  mocap_recording recording;
  ASSERT_EQ(mocap_health_get_recording(&handle, 0, &recording, sizeof recording), 1);
  EXPECT_STREQ(recording.error, "disk full");
  EXPECT_EQ(recording.state, MOCAP_RECORDING_FAILED);
}

TEST(ClientHealth, FillsOnlyMembersThatTheCallerKnows) {
  Feed feed = feed_of();
  feed.take(testing::envelope("health", health()), {});
  const mocap_health handle{feed.health()};
  struct Older {
    mocap_camera_health camera{};
  } older;
  older.camera.frames = 1;

  mocap_health_get_camera(&handle, 0, &older.camera, offsetof(mocap_camera_health, frames));

  EXPECT_STREQ(older.camera.name, "north");
  EXPECT_EQ(older.camera.frames, 1U);
}

TEST(ClientHealth, IgnoresFieldsOfALaterVersion) {
  Feed feed = feed_of();
  feed.take(testing::envelope("health", health()) + "\xca\xbb\x01\x03new", {});
  ASSERT_NE(feed.health(), nullptr);
  EXPECT_EQ(feed.health()->cameras.size(), 2U);
}

TEST(ClientEvents, AreReturnedOnceWithTheNamesOfTheirSubjects) {
  Feed feed = feed_of();
  feed.take(testing::description_message(), {});
  v1::Event found = event(v1::EVENT_KIND_SUBJECT_FOUND, 4);
  found.set_subject(0);
  found.set_message("T-pose");
  feed.take(testing::envelope("event", found), {});
  v1::Event unknown = event(v1::EVENT_KIND_SUBJECT_LOST, 5);
  unknown.set_subject(99);
  feed.take(testing::envelope("event", unknown), {});

  mocap_event read;
  ASSERT_TRUE(feed.next_event(read));
  EXPECT_EQ(read.kind, MOCAP_EVENT_SUBJECT_FOUND);
  EXPECT_EQ(read.sequence, 4U);
  EXPECT_STREQ(read.name, "actor");
  EXPECT_STREQ(read.message, "T-pose");
  ASSERT_TRUE(feed.next_event(read));
  EXPECT_STREQ(read.name, "");
  EXPECT_FALSE(feed.next_event(read));
}

TEST(ClientEvents, AreBoundedIfNobodyTakesThem) {
  Feed feed = feed_of();
  for (std::uint64_t i = 0; i < 1000; ++i)
    feed.take(testing::envelope("event", event(v1::EVENT_KIND_CAMERA_LOST, i)), {});

  mocap_event read;
  ASSERT_TRUE(feed.next_event(read));
  EXPECT_EQ(read.sequence, 1000U - 256U);
}

v1::Request parsed(const mocap_request& request) {
  v1::Request message;
  EXPECT_TRUE(message.ParseFromString(encode_request(request, 3)));
  EXPECT_EQ(message.id(), 3U);
  return message;
}

mocap_request request_of(std::int32_t kind) {
  mocap_request request;
  mocap_request_init(&request, sizeof request, kind);
  request.name = "anna";
  return request;
}

TEST(ClientRequest, IsTheMessageOfItsKind) {
  EXPECT_TRUE(parsed(request_of(MOCAP_REQUEST_STATUS)).has_status());
  EXPECT_TRUE(parsed(request_of(MOCAP_REQUEST_RELOAD)).has_reload());
  EXPECT_TRUE(parsed(request_of(kDescriptionRequest)).has_description());
  EXPECT_TRUE(parsed(request_of(kSnapshotRequest)).has_snapshot());
  EXPECT_EQ(parsed(request_of(MOCAP_REQUEST_CAPTURE_START)).capture().action(), v1::CaptureRequest::ACTION_START);
  EXPECT_EQ(parsed(request_of(MOCAP_REQUEST_CAPTURE_STOP)).capture().action(), v1::CaptureRequest::ACTION_STOP);
  for (const auto& [kind, action] : {std::pair{MOCAP_REQUEST_SUBJECT_ADD, v1::SubjectRequest::ACTION_ADD},
                                     {MOCAP_REQUEST_SUBJECT_REMOVE, v1::SubjectRequest::ACTION_REMOVE},
                                     {MOCAP_REQUEST_SUBJECT_RESET, v1::SubjectRequest::ACTION_RESET}}) {
    const v1::Request read = parsed(request_of(kind));
    EXPECT_EQ(read.subject().action(), action);
    EXPECT_EQ(read.subject().name(), "anna");
  }
  EXPECT_TRUE(encode_request(request_of(99), 1).empty());
}

TEST(ClientRequest, HasItsArguments) {
  mocap_request add = request_of(MOCAP_REQUEST_SUBJECT_ADD);
  add.marker_set = "/etc/x.toml";
  EXPECT_EQ(parsed(add).subject().marker_set(), "/etc/x.toml");

  const double rest[] = {1, 2, 3}, markers[] = {4, 5, 6, 7, 8, 9};
  mocap_request fit = request_of(MOCAP_REQUEST_SUBJECT_FIT);
  fit.rest_offsets_m = rest;
  fit.rest_offset_count = 3;
  fit.marker_offsets_m = markers;
  fit.marker_offset_count = 6;
  fit.residual_m = 0.5;
  EXPECT_THAT(parsed(fit).subject().rest_offsets_m(), ElementsAre(1, 2, 3));
  EXPECT_THAT(parsed(fit).subject().marker_offsets_m(), ElementsAre(4, 5, 6, 7, 8, 9));
  EXPECT_EQ(parsed(fit).subject().residual_m(), 0.5);

  mocap_request camera = request_of(MOCAP_REQUEST_CAMERA_SET);
  camera.exposure_us = 700;
  EXPECT_EQ(parsed(camera).camera().exposure_us(), 700);
  EXPECT_FALSE(parsed(camera).camera().has_gain_db());

  mocap_request mask = request_of(MOCAP_REQUEST_MASK_LEARN);
  mask.images = 12;
  EXPECT_EQ(parsed(mask).mask().images(), 12U);
  EXPECT_EQ(parsed(mask).mask().camera(), "anna");
}

TEST(ClientRequest, OrdersTakes) {
  for (const auto& [kind, action] : {std::pair{MOCAP_REQUEST_TAKE_START, v1::TakeRequest::ACTION_START},
                                     {MOCAP_REQUEST_TAKE_STOP, v1::TakeRequest::ACTION_STOP},
                                     {MOCAP_REQUEST_TAKE_CANCEL, v1::TakeRequest::ACTION_CANCEL},
                                     {MOCAP_REQUEST_TAKE_MARK, v1::TakeRequest::ACTION_MARK},
                                     {MOCAP_REQUEST_TAKE_NEXT, v1::TakeRequest::ACTION_NEXT}}) {
    EXPECT_EQ(parsed(request_of(kind)).take().action(), action);
  }
  mocap_request start = request_of(MOCAP_REQUEST_TAKE_START);
  start.slate = "12A";
  start.text = "a note";
  start.before_s = 1.5;
  start.seconds = 2.5;
  start.countdown_s = 3.5;
  start.at_utc_ns = 4;

  const v1::TakeRequest take = parsed(start).take();

  EXPECT_EQ(take.name(), "anna");
  EXPECT_EQ(take.slate(), "12A");
  EXPECT_EQ(take.text(), "a note");
  EXPECT_EQ(take.before_s(), 1.5);
  EXPECT_EQ(take.seconds(), 2.5);
  EXPECT_EQ(take.countdown_s(), 3.5);
  EXPECT_EQ(take.at_utc_ns(), 4);
}

TEST(ClientAnswer, HasTheStatus) {
  v1::Answer said;
  said.set_id(3);
  said.set_code(v1::CODE_DONE);
  said.mutable_status()->set_role("viewer");
  said.mutable_status()->set_capturing(true);
  *said.mutable_status()->mutable_health() = health();
  v1::SubjectStatus& anna = *said.mutable_status()->add_subjects();
  anna.set_name("anna");
  anna.set_away(true);
  mocap_answer handle;
  ASSERT_EQ(decode_answer(said.SerializeAsString(), handle.answer), nullptr);

  mocap_status status;
  ASSERT_EQ(mocap_answer_get_status(&handle, &status, sizeof status), 1);
  EXPECT_STREQ(status.role, "viewer");
  EXPECT_EQ(status.subject_count, 1U);
  mocap_subject_status subject;
  ASSERT_EQ(mocap_answer_get_subject(&handle, 0, &subject, sizeof subject), 1);
  EXPECT_STREQ(subject.name, "anna");
  EXPECT_EQ(subject.phase, MOCAP_PHASE_SEARCHING);
  EXPECT_EQ(subject.away, 1);
  mocap_health report;
  ASSERT_EQ(mocap_answer_get_health(&handle, &report), 1);
  EXPECT_EQ(report.health->cameras.size(), 2U);
}

TEST(ClientAnswer, TreatsAnUnknownCodeAsFailed) {
  Answer answer;
  ASSERT_EQ(decode_answer("\x08\x03\x10\x63", answer), nullptr);  // id 3, code 99
  EXPECT_EQ(answer.code, MOCAP_CODE_FAILED);
  EXPECT_NE(decode_answer("\xff\xff", answer), nullptr);
}

TEST(ClientControl, NamesTheInvalidOptionAndAcceptsNull) {
  mocap_control_options options;
  mocap_control_options_init(&options, sizeof options);
  char fault[256];
  options.timeout_ms = 0;
  EXPECT_EQ(mocap_control_open(&options, fault, sizeof fault), nullptr);
  EXPECT_THAT(fault, HasSubstr("timeout_ms is 0, expected 1 to 600000"));
  mocap_control_options_init(&options, sizeof options);
  options.endpoint = "nonsense";
  EXPECT_EQ(mocap_control_open(&options, fault, sizeof fault), nullptr);
  EXPECT_THAT(fault, HasSubstr("tcp://ADDRESS:PORT"));
  mocap_control_options_init(&options, sizeof options);
  options.secret_key = "short";
  EXPECT_EQ(mocap_control_open(&options, fault, sizeof fault), nullptr);
  EXPECT_THAT(fault, HasSubstr("is neither a key"));

  mocap_control_close(nullptr);
  mocap_answer_free(nullptr);
  EXPECT_LT(mocap_control_ask(nullptr, nullptr, nullptr), 0);
  EXPECT_STREQ(mocap_answer_message(nullptr), "");
}

TEST(ClientControl, RefusesAnUnknownKindWithoutAConnection) {
  mocap_control* control = mocap_control_open(nullptr, nullptr, 0);
  mocap_answer* answer = mocap_answer_new();
  for (const std::int32_t kind : {0, 99, kSnapshotRequest}) {
    const mocap_request request = request_of(kind);
    EXPECT_EQ(mocap_control_ask(control, &request, answer), MOCAP_CODE_INVALID);
    EXPECT_THAT(mocap_answer_message(answer), HasSubstr("expected an enum mocap_request_kind"));
  }
  mocap_answer_free(answer);
  mocap_control_close(control);
}

TEST(ClientText, IsCutBeforeAnIncompleteCharacter) {
  char into[4];
  copy_text(into, sizeof into, "ab\u00e4");  // 4 bytes of UTF-8
  EXPECT_STREQ(into, "ab");
  copy_text(into, sizeof into, "abc");
  EXPECT_STREQ(into, "abc");
  copy_text(into, sizeof into, "");
  EXPECT_STREQ(into, "");
}

TEST(ClientText, NamesWhatExistsAndSuggestsTheNearest) {
  EXPECT_EQ(unknown_name("bone", "head", "'anna'", {"Hips", "Head"}),
            "'anna' has no bone 'head', did you mean 'Head'?; its bones are Hips, Head");
  EXPECT_EQ(unknown_name("bone", "tail", "'anna'", {"Hips", "Head"}),
            "'anna' has no bone 'tail'; its bones are Hips, Head");
  EXPECT_EQ(unknown_name("marker", "x", "'anna'", {}), "'anna' has no marker 'x'; it has none");
}

}  // namespace
}  // namespace mocap::client
