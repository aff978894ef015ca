#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "random_model.h"
#include "sample_description.h"
#include "support/typical_snapshot.h"
#include "wire/codec/decode.h"
#include "wire/codec/encode.h"
#include "wire/codec/snapshot_encoder.h"

namespace mocap::wire {
namespace encode_decode_test {

using ::mocap::wire::testing::RandomModel;
using ::mocap::wire::testing::sample_description;
using ::testing::HasSubstr;

void expect_same(const Instants& a, const Instants& b) {
  EXPECT_EQ(a.exposed_at, b.exposed_at);
  EXPECT_EQ(a.received_at, b.received_at);
  EXPECT_EQ(a.detected_at, b.detected_at);
  EXPECT_EQ(a.fused_at, b.fused_at);
  EXPECT_EQ(a.sent_at, b.sent_at);
}

void expect_same(const LabelledMarker& a, const LabelledMarker& b) {
  EXPECT_EQ(a.state, b.state);
  EXPECT_EQ(a.position.v, b.position.v);
  EXPECT_EQ(a.residual_px, b.residual_px);
  EXPECT_EQ(a.cameras, b.cameras);
  EXPECT_EQ(a.confidence, b.confidence);
  EXPECT_EQ(a.track, b.track);
}

void expect_same(const Pose& a, const Pose& b) {
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.rotation.coeffs(), b.rotation.coeffs());
}

void expect_same(const SubjectPose& a, const SubjectPose& b) {
  EXPECT_EQ(a.subject, b.subject);
  EXPECT_EQ(a.residual_m, b.residual_m);
  EXPECT_EQ(a.smoothing_delay_s, b.smoothing_delay_s);
  ASSERT_EQ(a.bones.size(), b.bones.size());
  for (std::size_t i = 0; i < a.bones.size(); ++i) {
    EXPECT_EQ(a.bones[i].state, b.bones[i].state);
    EXPECT_EQ(a.bones[i].confidence, b.bones[i].confidence);
    expect_same(a.bones[i].world_from_bone, b.bones[i].world_from_bone);
    expect_same(a.bones[i].parent_from_bone, b.bones[i].parent_from_bone);
    EXPECT_EQ(a.bones[i].velocity_m_s, b.bones[i].velocity_m_s);
    EXPECT_EQ(a.bones[i].spin_rad_s, b.bones[i].spin_rad_s);
  }
}

void expect_same(const Snapshot& a, const Snapshot& b) {
  EXPECT_EQ(a.number, b.number);
  EXPECT_EQ(a.description_version, b.description_version);
  EXPECT_EQ(a.expected_views, b.expected_views);
  expect_same(a.instants, b.instants);
  EXPECT_EQ(a.timecode, b.timecode);
  ASSERT_EQ(a.views.size(), b.views.size());
  for (std::size_t i = 0; i < a.views.size(); ++i) {
    EXPECT_EQ(a.views[i].camera, b.views[i].camera);
    EXPECT_EQ(a.views[i].frame_number, b.views[i].frame_number);
    EXPECT_EQ(a.views[i].skew, b.views[i].skew);
    EXPECT_EQ(a.views[i].blobs, b.views[i].blobs);
  }
  ASSERT_EQ(a.labels.size(), b.labels.size());
  for (std::size_t s = 0; s < a.labels.size(); ++s) {
    EXPECT_EQ(a.labels[s].subject, b.labels[s].subject);
    EXPECT_EQ(a.labels[s].phase, b.labels[s].phase);
    ASSERT_EQ(a.labels[s].markers.size(), b.labels[s].markers.size());
    for (std::size_t m = 0; m < a.labels[s].markers.size(); ++m) {
      expect_same(a.labels[s].markers[m], b.labels[s].markers[m]);
    }
  }
  ASSERT_EQ(a.poses.size(), b.poses.size());
  for (std::size_t s = 0; s < a.poses.size(); ++s) expect_same(a.poses[s], b.poses[s]);
  ASSERT_EQ(a.unlabelled.size(), b.unlabelled.size());
  for (std::size_t i = 0; i < a.unlabelled.size(); ++i) {
    EXPECT_EQ(a.unlabelled[i].track, b.unlabelled[i].track);
    EXPECT_EQ(a.unlabelled[i].position.v, b.unlabelled[i].position.v);
    EXPECT_EQ(a.unlabelled[i].residual_px, b.unlabelled[i].residual_px);
    EXPECT_EQ(a.unlabelled[i].cameras, b.unlabelled[i].cameras);
  }
}

v1::Snapshot over_the_wire(const v1::Snapshot& message) {
  v1::Snapshot arrived;
  EXPECT_TRUE(arrived.ParseFromString(message.SerializeAsString()));
  return arrived;
}

TEST(EncodeSnapshot, RoundTripsThroughAReusedMessage) {
  RandomModel random(1);
  v1::Snapshot message;
  for (int round = 0; round < 300; ++round) {
    const Snapshot sent = random.snapshot();

    encode(sent, message);
    const Result<Snapshot> read = decode(over_the_wire(message));

    ASSERT_TRUE(read) << read.error().message;
    expect_same(sent, *read);
    if (HasFatalFailure() || HasNonfatalFailure()) return;
  }
}

TEST(EncodeSnapshot, EncodesASnapshotAtAllDesignBounds) {
  RandomModel random(2);
  Snapshot full;
  for (std::uint32_t i = 0; i < kMaxCameras; ++i) full.views.push_back({CameraId{i}, i, Duration(i), i});
  for (std::uint32_t s = 0; s < kMaxSubjects; ++s) {
    SubjectLabels& labels = full.labels.push_back({});
    labels.subject = SubjectId{s};
    while (!labels.markers.full()) labels.markers.push_back(random.label());
    SubjectPose& pose = full.poses.push_back({});
    pose.subject = SubjectId{s};
    pose.bones.resize(kMaxBones);
  }
  full.unlabelled.resize(kMaxMarkers);

  v1::Snapshot message;
  encode(full, message);
  const Result<Snapshot> read = decode(over_the_wire(message));

  ASSERT_TRUE(read) << read.error().message;
  expect_same(full, *read);
}

TEST(EncodeSnapshot, OmitsUnknownFields) {
  v1::Snapshot message;
  RandomModel random(3);
  encode(random.snapshot(), message);  // the next encode must remove all of this

  encode(Snapshot{}, message);

  EXPECT_TRUE(message.has_instants());
  EXPECT_FALSE(message.instants().has_received_at_ns());
  EXPECT_FALSE(message.instants().has_sent_at_ns());
  EXPECT_FALSE(message.has_sequence());
  EXPECT_FALSE(message.has_utc_minus_host_ns());
  EXPECT_FALSE(message.has_views());
  EXPECT_FALSE(message.has_unlabelled());
  EXPECT_EQ(message.subjects_size(), 0);
}

TEST(EncodeSnapshot, WritesZerosForALostMarker) {
  Snapshot snapshot;
  SubjectLabels& labels = snapshot.labels.push_back({});
  labels.subject = SubjectId{0};
  LabelledMarker& lost = labels.markers.push_back({});
  lost.position.v = {1.0, std::numeric_limits<double>::quiet_NaN(), 3.0};

  v1::Snapshot message;
  encode(snapshot, message);

  EXPECT_THAT(message.subjects(0).markers().positions_m(), ::testing::ElementsAre(0.0F, 0.0F, 0.0F));
}

TEST(EncodeHealth, WritesEachCounterOfTheFeedToItsField) {
  Health health;
  health.feed = {1, 2, 3, 4, 5, 6, 7, 8, 9};

  v1::Health message;
  encode(health, message);
  const v1::FeedHealth& feed = message.feed();
  const Result<Health> back = decode(message);

  EXPECT_EQ(feed.listeners(), 1U);
  EXPECT_EQ(feed.cut_off(), 6U);
  EXPECT_EQ(feed.failed_accepts(), 8U);
  EXPECT_EQ(feed.behind(), 9U);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->feed.failed_accepts, 8U);
  EXPECT_EQ(back->feed.behind, 9U);
}

TEST(EncodeHealth, RoundTripsTheStateOfTheAuditLog) {
  Health health;
  v1::Health message;
  encode(health, message);
  EXPECT_FALSE(message.has_audit());
  health.audit = {.on = true, .lines = 5, .waiting = 2, .lost = 1, .error = bounded_text<255>("no space")};

  encode(health, message);
  const Result<Health> back = decode(message);

  ASSERT_TRUE(back);
  EXPECT_TRUE(back->audit.on);
  EXPECT_EQ(std::tuple(back->audit.lines, back->audit.waiting, back->audit.lost), std::tuple(5U, 2U, 1U));
  EXPECT_EQ(text_of(back->audit.error), "no space");
}

TEST(EncodeHealth, RoundTripsTheReasonsOfMissingSubjects) {
  Health health;
  SearchHealth& sent = health.searches.emplace_back();
  sent.subject = SubjectId{3};
  sent.cause = SearchCause::OutOfView;
  sent.points = 20;
  sent.still = 19;
  sent.markers = 41;
  sent.explained = 18;
  sent.missing.push_back({7, WorldPoint{{0.5, -0.25, 1.75}}, 2});
  sent.known_set = bounded_text<63>("openmocap18");
  sent.known_set_markers = 18;
  sent.sentence = bounded_text<511>("anna is not found: move");

  v1::Health message;
  encode(health, message);
  const Result<Health> back = decode(message);

  ASSERT_TRUE(back);
  ASSERT_EQ(back->searches.size(), 1U);
  const SearchHealth& came = back->searches[0];
  EXPECT_EQ(came.subject, sent.subject);
  EXPECT_EQ(came.cause, sent.cause);
  EXPECT_EQ(message.searches(0).cause(), v1::SEARCH_CAUSE_OUT_OF_VIEW);
  EXPECT_EQ(std::tuple(came.points, came.still, came.markers, came.explained), std::tuple(20U, 19U, 41U, 18U));
  ASSERT_EQ(came.missing.size(), 1U);
  EXPECT_EQ(came.missing[0].marker, 7U);
  EXPECT_EQ(came.missing[0].position.v, sent.missing[0].position.v);
  EXPECT_EQ(came.missing[0].in_view_of, 2U);
  EXPECT_EQ(text_of(came.known_set), "openmocap18");
  EXPECT_EQ(came.known_set_markers, 18U);
  EXPECT_EQ(text_of(came.sentence), "anna is not found: move");
}

TEST(EncodeHealth, RoundTripsTheStateOfTimecode) {
  Health health;
  health.at = from_ns(20'000'000'000);
  TimecodeHealth& sent = health.timecode;
  sent.source = TimecodeSourceKind::Ltc;
  sent.state = TimecodeState::Coasting;
  sent.clock = TimecodeClock{};
  sent.clock->format = {0, 0, 0, 0, 25};
  sent.clock->at = from_ns(19'000'000'000);
  sent.clock->frames_at = 25.0 * 3600.0;
  sent.clock->frames_per_s = 25.0;
  sent.last_frame_at = from_ns(18'500'000'000);
  sent.drift_ppm = 12.5;
  sent.frames = 1;
  sent.rejected_frames = 2;
  sent.jumps = 3;
  sent.sentence = bounded_text<255>("no signal");
  v1::Health message;

  encode(health, message);
  const Result<Health> back = decode(message);

  EXPECT_FALSE(message.timecode().locked());
  EXPECT_DOUBLE_EQ(message.timecode().age_s(), 1.5);
  EXPECT_EQ(message.timecode().now().hours(), 1U);
  EXPECT_EQ(message.timecode().now().seconds(), 1U);
  ASSERT_TRUE(back);
  const TimecodeHealth& came = back->timecode;
  EXPECT_EQ(came.source, TimecodeSourceKind::Ltc);
  EXPECT_EQ(came.state, TimecodeState::Coasting);
  EXPECT_EQ(text_of(*timecode_at(*came.clock, health.at)), "01:00:01:00");
  EXPECT_EQ(came.last_frame_at, sent.last_frame_at);
  EXPECT_EQ(came.drift_ppm, 12.5);
  EXPECT_EQ(came.frames, 1U);
  EXPECT_EQ(came.rejected_frames, 2U);
  EXPECT_EQ(came.jumps, 3U);
  EXPECT_EQ(text_of(came.sentence), "no signal");
}

TEST(EncodeHealth, HasNoTimecodeWithoutASource) {
  v1::Health message;
  encode(Health{}, message);

  EXPECT_FALSE(message.has_timecode());
  EXPECT_EQ(decode(message)->timecode.source, TimecodeSourceKind::None);
}

TEST(EncodeHealth, RoundTripsRecordings) {
  Health health;
  health.recordings = {{"a.jsonl", RecordingState::Recording, 1, 2, ""},
                       {"b.blobs", RecordingState::Ended, 3, 4, ""},
                       {"c.pb", RecordingState::Failed, 5, 6, "no space \xFF"}};

  v1::Health message;
  encode(health, message);
  const Result<Health> back = decode(message);
  message.mutable_recordings(0)->set_state(static_cast<v1::RecordingState>(77));
  const Result<Health> unknown = decode(message);

  ASSERT_TRUE(back);
  ASSERT_EQ(back->recordings.size(), 3U);
  EXPECT_EQ(back->recordings[1].state, RecordingState::Ended);
  EXPECT_EQ(back->recordings[1].size_bytes, 3U);
  EXPECT_EQ(back->recordings[1].records, 4U);
  EXPECT_EQ(back->recordings[2].path, "c.pb");
  EXPECT_EQ(back->recordings[2].state, RecordingState::Failed);
  EXPECT_EQ(back->recordings[2].error, "no space ?");
  ASSERT_TRUE(unknown);
  EXPECT_EQ(unknown->recordings[0].state, RecordingState::Recording);
}

TEST(EncodeSnapshot, ClearsTheDescriptionOfAReusedMessage) {
  v1::Snapshot message;
  *message.mutable_description() = encode(sample_description(7));

  encode(Snapshot{}, message);

  EXPECT_FALSE(message.has_description());
}

// Encoded as by the feed, without the local positions that a client knows from the description.
TEST(EncodeSnapshot, Needs2500BytesFor60MarkersAnd24Bones) {
  const Description description = support::typical_description();
  const Snapshot snapshot = support::typical_snapshot(description);
  ASSERT_TRUE(stands_at_rest_offsets(snapshot, description));

  v1::Snapshot message;
  encode(snapshot, message, {.local_positions = false, .velocities = false});
  message.set_sequence(20'000'000);
  message.set_utc_minus_host_ns(1'790'000'000'000'000'000);

  EXPECT_LT(message.ByteSizeLong(), 2500U);
}

TEST(SnapshotEncoder, WritesTheSameBytesAsProtobuf) {
  RandomModel random(41);
  SnapshotEncoder encoder;
  v1::Snapshot message;
  for (int round = 0; round < 300; ++round) {
    const Snapshot snapshot = random.snapshot();
    Parts parts;
    parts.views = random.coin();
    parts.markers = random.coin();
    parts.bones = random.coin();
    parts.local_positions = random.coin();
    parts.velocities = random.coin();
    parts.unlabelled = random.coin();
    if (random.coin()) parts.subject = SubjectId{random.up_to(2)};
    SenderFields sender;
    encode(snapshot, message, parts);
    if (random.coin()) message.set_sequence(*(sender.sequence = random.up_to(0xFFFF'FFFFU)));
    if (random.coin()) message.set_utc_minus_host_ns(*(sender.utc_minus_host_ns = -std::int64_t{random.up_to(1000)}));
    if (random.coin()) message.set_synchronisation(*(sender.synchronisation = v1::SYNCHRONISATION_SOME));

    const auto bytes = encoder.encode("topic", snapshot, parts, sender);

    ASSERT_EQ(std::string(bytes.begin(), bytes.end()), "topic" + message.SerializeAsString()) << "round " << round;
  }
}

TEST(SnapshotEncoder, EncodesASnapshotAtAllDesignBounds) {
  Snapshot full;
  full.number = std::numeric_limits<std::uint64_t>::max();
  for (std::uint32_t i = 0; i < kMaxCameras; ++i) {
    full.views.push_back({CameraId{i}, full.number, Duration(std::numeric_limits<std::int64_t>::min()), 0xFFFF'FFFF});
  }
  for (std::uint32_t s = 0; s < kMaxSubjects; ++s) {
    SubjectLabels& labels = full.labels.push_back({});
    labels.subject = SubjectId{s};
    labels.markers.resize(kMaxLabels);
    for (LabelledMarker& marker : labels.markers) {
      marker.state = LabelState::Measured;
      marker.residual_px = 1e9;
      marker.cameras = 0xFFFF'FFFF;
      marker.track = TrackId{0xFFFF'FFFE};
    }
    full.poses.push_back({}).subject = SubjectId{s};
    full.poses[s].bones.resize(kMaxBones);
  }
  full.unlabelled.resize(kMaxMarkers);
  for (UnlabelledMarker& marker : full.unlabelled) marker = {TrackId{0xFFFF'FFFE}, {}, 1e9, 0xFFFF'FFFF};
  SnapshotEncoder encoder;
  v1::Snapshot message;
  encode(full, message);

  const auto bytes = encoder.encode("", full, {}, {});

  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), message.SerializeAsString());
}

TEST(EncodeSnapshot, OmitsPartsThatAreNotSelected) {
  const Description description = support::typical_description();
  const Snapshot snapshot = support::typical_snapshot(description);
  v1::Snapshot message;
  encode(snapshot, message);  // the next encode must remove all of this

  encode(snapshot, message,
         {.views = false, .markers = false, .local_positions = false, .velocities = false, .unlabelled = false});

  EXPECT_FALSE(message.has_views());
  EXPECT_FALSE(message.subjects(0).has_markers());
  EXPECT_EQ(message.subjects(0).bones().states_size(), 24);
  EXPECT_TRUE(message.subjects(0).bones().local_positions_m().empty());
  EXPECT_TRUE(message.subjects(0).bones().velocities_m_s().empty());
  EXPECT_TRUE(message.subjects(0).bones().spins_rad_s().empty());
  encode(snapshot, message, {.bones = false});
  EXPECT_FALSE(message.subjects(0).has_bones());
  encode(snapshot, message, {.subject = SubjectId{3}});
  EXPECT_EQ(message.subjects_size(), 0);
}

TEST(EncodeSnapshot, OmitsLocalPositionsOnlyIfTheyEqualTheRestOffsets) {
  const Description description = support::typical_description();
  Snapshot snapshot = support::typical_snapshot(description);
  EXPECT_TRUE(stands_at_rest_offsets(snapshot, description));

  snapshot.description_version = 2;
  EXPECT_FALSE(stands_at_rest_offsets(snapshot, description));
  snapshot.description_version = 1;
  snapshot.poses[0].bones[5].parent_from_bone.position.x() += 1e-4;
  EXPECT_FALSE(stands_at_rest_offsets(snapshot, description));
  snapshot.poses[0].bones[5].state = BoneState::Lost;
  EXPECT_TRUE(stands_at_rest_offsets(snapshot, description));
}

TEST(DecodeSnapshot, FillsOmittedLocalPositionsFromTheDescription) {
  const Description description = support::typical_description();
  const Snapshot sent = support::typical_snapshot(description);
  v1::Snapshot message;
  encode(sent, message, {.local_positions = false});

  Result<Snapshot> read = decode(message);
  ASSERT_TRUE(read) << read.error().message;
  put_at_rest_offsets(message, description, *read);

  for (std::size_t i = 0; i < sent.poses[0].bones.size(); ++i) {
    const Eigen::Vector3d& was = sent.poses[0].bones[i].parent_from_bone.position;
    EXPECT_LT((read->poses[0].bones[i].parent_from_bone.position - was).norm(), 1e-6)
        << "bone " << i;  // m; single precision
  }
}

TEST(DecodeSnapshot, NamesTheColumnOfWrongLength) {
  RandomModel random(5);
  Snapshot snapshot;
  snapshot.unlabelled.resize(2);
  v1::Snapshot message;
  encode(snapshot, message);
  message.mutable_unlabelled()->add_positions_m(1.0F);

  const Result<Snapshot> read = decode(message);

  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(read.error().message, HasSubstr("positions_m has 7 numbers, expected 6 for 2 entries"));
}

TEST(DecodeSnapshot, RejectsMoreEntriesThanTheBounds) {
  v1::Snapshot message;
  encode(Snapshot{}, message);
  for (std::size_t i = 0; i <= kMaxSubjects; ++i) message.add_subjects()->set_subject(static_cast<std::uint32_t>(i));

  ASSERT_FALSE(decode(message));
  EXPECT_THAT(decode(message).error().message, HasSubstr("subjects has 17 entries"));
}

TEST(DecodeSnapshot, RejectsADuplicateSubject) {
  Snapshot snapshot;
  snapshot.labels.push_back({}).subject = SubjectId{3};
  v1::Snapshot message;
  encode(snapshot, message);
  *message.add_subjects() = message.subjects(0);

  ASSERT_FALSE(decode(message));
  EXPECT_THAT(decode(message).error().message, HasSubstr("subject 3 occurs twice"));
}

TEST(DecodeSnapshot, RejectsNumbersThatAreNotFinite) {
  Snapshot snapshot;
  snapshot.unlabelled.resize(1);
  v1::Snapshot message;
  encode(snapshot, message);
  message.mutable_unlabelled()->set_positions_m(1, std::numeric_limits<float>::quiet_NaN());

  EXPECT_FALSE(decode(message));
}

TEST(DecodeSnapshot, RejectsARotationThatIsNotAUnitQuaternion) {
  Snapshot snapshot;
  SubjectPose& pose = snapshot.poses.push_back({});
  pose.subject = SubjectId{0};
  pose.bones.resize(1);
  v1::Snapshot message;
  encode(snapshot, message);
  message.mutable_subjects(0)->mutable_bones()->set_local_rotations_xyzw(3, 0.5F);

  ASSERT_FALSE(decode(message));
  EXPECT_THAT(decode(message).error().message, HasSubstr("local_rotations_xyzw: rotation 0 has length 0.5"));
}

TEST(DecodeSnapshot, ReadsAnUnknownStateAsLost) {
  Snapshot snapshot;
  SubjectLabels& labels = snapshot.labels.push_back({});
  labels.subject = SubjectId{0};
  labels.markers.push_back({}).state = LabelState::Measured;
  v1::Snapshot message;
  encode(snapshot, message);
  message.mutable_subjects(0)->mutable_markers()->set_states(0, static_cast<v1::MarkerState>(77));

  const Result<Snapshot> read = decode(over_the_wire(message));

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->labels[0].markers[0].state, LabelState::Lost);
}

// Any bytes must give an error or a snapshot that can be encoded again.
TEST(DecodeSnapshot, SurvivesDamagedMessages) {
  RandomModel random(6);
  int accepted = 0;
  for (int round = 0; round < 3000; ++round) {
    v1::Snapshot message;
    encode(random.snapshot(8), message);
    std::string bytes = message.SerializeAsString();
    for (std::uint32_t i = 0, n = 1 + random.up_to(7); i < n; ++i) {
      bytes[random.up_to(static_cast<std::uint32_t>(bytes.size()) - 1)] = static_cast<char>(random.up_to(255));
    }
    if (random.coin()) bytes.resize(random.up_to(static_cast<std::uint32_t>(bytes.size())));

    v1::Snapshot damaged;
    if (!damaged.ParseFromString(bytes)) continue;
    const Result<Snapshot> read = decode(damaged);

    if (!read) continue;
    ++accepted;
    encode(*read, message);
    EXPECT_TRUE(decode(message));
  }
  EXPECT_GT(accepted, 0);
}

TEST(DecodeSnapshot, SurvivesRandomBytes) {
  RandomModel random(7);
  for (int round = 0; round < 20000; ++round) {
    std::string bytes(random.up_to(200), '\0');
    for (char& byte : bytes) byte = static_cast<char>(random.up_to(255));
    v1::Snapshot message;
    if (message.ParseFromString(bytes)) (void)decode(message);
    v1::Description description;
    if (description.ParseFromString(bytes)) (void)decode(description);
    v1::Health health;
    if (health.ParseFromString(bytes)) (void)decode(health);
  }
}

TEST(EncodeDescription, RoundTrips) {
  Description sent = sample_description(7);
  sent.camera_rates_hz = {120.0, 60.0};

  const Result<Description> read = decode(encode(sent));

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->version, 7U);
  EXPECT_EQ(read->producer, sent.producer);
  EXPECT_EQ(read->session_id, sent.session_id);
  EXPECT_EQ(read->nominal_rate_hz, 120.0);
  ASSERT_EQ(read->cameras.size(), 2U);
  EXPECT_EQ(read->cameras[1].name, "south");
  EXPECT_EQ(read->camera_rates_hz, sent.camera_rates_hz);
  EXPECT_EQ(read->cameras[1].lens.kind, LensKind::Fisheye);
  EXPECT_EQ(read->cameras[0].lens.distortion, sent.cameras[0].lens.distortion);
  // The rotation is transmitted as a quaternion: tolerance of a few roundings in double precision.
  EXPECT_TRUE(read->cameras[0].camera_from_world.rotation.isApprox(sent.cameras[0].camera_from_world.rotation, 1e-14));
  EXPECT_EQ(read->cameras[0].camera_from_world.translation, sent.cameras[0].camera_from_world.translation);
  const MarkerSet& set = read->subjects.at(0).marker_set;
  ASSERT_EQ(set.skeleton.bones.size(), 2U);
  EXPECT_EQ(set.skeleton.bones[0].parent, -1);
  EXPECT_EQ(set.skeleton.bones[1].parent, 0);
  EXPECT_EQ(set.skeleton.bones[0].aliases.unreal, "pelvis");
  EXPECT_EQ(set.skeleton.bones[0].rotation_limits[1]->max_rad, 2.0);
  EXPECT_FALSE(set.skeleton.bones[0].rotation_limits[2]);
  EXPECT_EQ(set.markers.at(1).name, "ChestMarker");
  EXPECT_EQ(set.markers.at(1).offset_m, Eigen::Vector3d(0.0, 0.2, 0.0));
  EXPECT_EQ(set.markers.at(0).colour, (std::array<float, 3>{1.0F, 0.5F, 0.25F}));
}

TEST(EncodeDescription, StatesTheConventions) {
  const v1::Description message = encode(sample_description());

  EXPECT_EQ(message.protocol(), "mocap.v1");
  EXPECT_EQ(message.conventions().length_unit(), v1::LENGTH_UNIT_METRE);
  EXPECT_EQ(message.conventions().handedness(), v1::HANDEDNESS_RIGHT);
  EXPECT_EQ(message.conventions().up_axis(), v1::AXIS_Z);
  EXPECT_EQ(message.conventions().quaternion_order(), v1::QUATERNION_ORDER_XYZW);
}

TEST(DecodeDescription, RejectsAnotherProtocol) {
  v1::Description message = encode(sample_description());
  message.set_protocol("mocap.v2");

  ASSERT_FALSE(decode(message));
  EXPECT_THAT(decode(message).error().message, HasSubstr("protocol is 'mocap.v2', expected 'mocap.v1'"));
}

TEST(DecodeDescription, RejectsABoneBeforeItsParent) {
  v1::Description message = encode(sample_description());
  message.mutable_subjects(0)->mutable_bones(0)->set_parent(1);

  ASSERT_FALSE(decode(message));
  EXPECT_THAT(decode(message).error().message, HasSubstr("bone 'Hips': its parent 1 does not precede it"));
}

TEST(EncodeHealth, RoundTripsAndOmitsStagesWithoutSamples) {
  Health sent;
  sent.at = from_ns(123456789);
  sent.set_rate_hz = 59.5;
  sent.sets = 100;
  sent.complete_sets = 99;
  sent.latency[static_cast<std::size_t>(LatencyStage::Fuse)] = {60, Duration(1000), Duration(2000), Duration(3000)};
  sent.latency_totals[2].counts[3] = 77;
  sent.latency_totals[2].sum = Duration(123'000'000);
  sent.cameras.push_back({"north",
                          CameraPhase::Reopening,
                          59.9,
                          100,
                          1,
                          2,
                          3,
                          5,
                          6,
                          7,
                          8,
                          "gone",
                          {10, 11, 12, 13, 14, 4, 15},
                          {38.0, 2.5, 12.0},
                          false,
                          1500.0,
                          40.0,
                          3.0,
                          16,
                          17,
                          9.5,
                          false,
                          0.0,
                          0.0,
                          0.0,
                          ClockSource::Lost,
                          true,
                          {20, 15},
                          0.75});

  v1::Health message;
  encode(sent, message);
  const Result<Health> read = decode(message);

  EXPECT_EQ(message.latencies_size(), 1);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->at, sent.at);
  EXPECT_EQ(read->complete_sets, 99U);
  EXPECT_EQ(read->latency[0].count, 0U);
  EXPECT_EQ(read->latency[2].p99, Duration(2000));
  EXPECT_EQ(message.latency_totals_size(), 1);
  EXPECT_EQ(read->latency_totals[2].counts, sent.latency_totals[2].counts);
  EXPECT_EQ(read->latency_totals[2].sum, Duration(123'000'000));
  ASSERT_EQ(read->cameras.size(), 1U);
  EXPECT_EQ(read->cameras[0].phase, CameraPhase::Reopening);
  const DetectionCounts& detection = read->cameras[0].detection;
  EXPECT_EQ(detection.blobs, 10U);
  EXPECT_EQ(detection.too_small, 11U);
  EXPECT_EQ(detection.too_large, 12U);
  EXPECT_EQ(detection.not_round, 13U);
  EXPECT_EQ(detection.too_dim, 14U);
  EXPECT_EQ(detection.dropped, 4U);
  EXPECT_EQ(detection.rows_given_up, 15U);
  EXPECT_EQ(read->cameras[0].levels.threshold_grey, 38.0);
  EXPECT_EQ(read->cameras[0].levels.noise_grey, 2.5);
  EXPECT_EQ(read->cameras[0].levels.background_grey, 12.0);
  EXPECT_EQ(read->cameras[0].missing_packets, 8U);
  EXPECT_EQ(read->cameras[0].blob_use.blobs, 20U);
  EXPECT_EQ(read->cameras[0].marker_share, 0.75);
  EXPECT_FALSE(read->cameras[0].synchronised);
  EXPECT_EQ(read->cameras[0].offset_us, 1500.0);
  EXPECT_EQ(read->cameras[0].drift_us_s, 40.0);
  EXPECT_EQ(read->cameras[0].jitter_us, 3.0);
  EXPECT_EQ(read->cameras[0].repeated_frames, 16U);
  EXPECT_EQ(read->cameras[0].clock_leaps, 17U);
  EXPECT_EQ(read->cameras[0].clock_uncertainty_us, 9.5);
  EXPECT_EQ(read->cameras[0].clock_source, ClockSource::Lost);
  EXPECT_TRUE(read->cameras[0].chunk_times);
  EXPECT_EQ(read->cameras[0].last_error, "gone");
}

TEST(EncodeHealth, ReplacesInvalidUtf8InDriverMessages) {
  Health sent;
  sent.cameras.resize(1);
  sent.cameras[0].last_error = "caf\xC3\xA9 \xFF\xC3 \xED\xA0\x80 end";

  v1::Health message;
  encode(sent, message);
  v1::Health arrived;
  ASSERT_TRUE(arrived.ParseFromString(message.SerializeAsString()));

  EXPECT_EQ(arrived.cameras(0).last_error(), "caf\xC3\xA9 ?\? ?\?? end");
}

}  // namespace encode_decode_test
}  // namespace mocap::wire
