#pragma once

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <string>
#include <vector>

#include "support/typical_snapshot.h"
#include "take/take_quality.h"
#include "take/take_reader.h"
#include "take/take_writer.h"
#include "wire/codec/camera_blobs.h"
#include "wire/codec/encode.h"

namespace mocap::take {

// A take whose every message follows from its number, so that a test recognises a wrong one. Set k has the blobs of two
// cameras and one snapshot, 1/120 s after set k - 1.

inline constexpr std::uint32_t kExampleCameras = 2;
inline constexpr std::int64_t kExamplePeriod_ns = 8'333'333;

inline Timestamp example_time(std::uint64_t set) {
  return from_ns(5'000'000'000 + static_cast<std::int64_t>(set) * kExamplePeriod_ns);
}

inline Description example_description() { return support::typical_description({12, 5, kExampleCameras}); }

inline BlobFrame example_blobs(std::uint32_t camera, std::uint64_t set) {
  std::mt19937_64 random(set * 64 + camera);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  BlobFrame frame;
  frame.camera = CameraId{camera};
  frame.number = set + 10 * camera;
  frame.exposed_at = example_time(set) + Duration(camera);
  frame.received_at = frame.exposed_at + std::chrono::milliseconds(2);
  frame.detected_at = frame.exposed_at + std::chrono::milliseconds(3);
  for (std::uint64_t i = 0; i < 8 + set % 5; ++i) {
    Blob blob;
    blob.centroid.v = {1280.0 * unit(random), 1024.0 * unit(random)};
    blob.sigma_px = 0.01 + unit(random);
    blob.area_px2 = 40.0 * unit(random);
    blob.peak = unit(random);
    blob.roundness = unit(random);
    if (i % 2 == 0) blob.axis_rad = unit(random);
    blob.saturated = unit(random);
    blob.touches_border = i % 3 == 0;
    blob.merged = i % 4 == 0;
    if (i % 5 != 0) blob.track = BlobTrackId{static_cast<std::uint32_t>(random())};
    frame.blobs.push_back(blob);
  }
  return frame;
}

inline Snapshot example_snapshot(std::uint64_t set) {
  static const Description description = example_description();
  Snapshot snapshot = support::typical_snapshot(description, static_cast<std::uint32_t>(set + 1));
  snapshot.number = set;
  snapshot.instants = {};
  snapshot.instants.exposed_at = example_time(set);
  return snapshot;
}

inline TakeStart example_start() {
  TakeStart start;
  start.info.name = "walk-3";
  start.info.slate = "12A";
  start.info.number = 3;
  start.info.notes = "first try\nshoe lost";
  start.info.tags = {"walk", "two subjects"};
  start.info.producer = "mocapd test";
  start.info.utc_minus_host = std::chrono::seconds(1'700'000'000);
  start.info.started_at = example_time(0);
  start.info.start_timecode = "10:00:00:00";
  start.description = example_description();
  start.files = {{"mocapd.toml", "application/toml", "[detect]\nthreshold = 40\n"},
                 {"rig.toml", "application/toml", std::string(3000, 'r')}};
  return start;
}

// Appends the sets from `from` to `to` (not included); stops at the first failure.
inline Status append_example(TakeWriter& writer, std::uint64_t from, std::uint64_t to) {
  for (std::uint64_t set = from; set < to; ++set) {
    for (std::uint32_t camera = 0; camera < kExampleCameras; ++camera) {
      if (const Status appended = writer.append(example_blobs(camera, set)); !appended) return appended;
    }
    if (const Status appended = writer.append(example_snapshot(set)); !appended) return appended;
  }
  return {};
}

/// The quality of a take in which all markers of many people were lost.
inline QualityReport crowd_report(std::size_t people) {
  Description description = support::typical_description({53, 20, kExampleCameras});
  description.subjects.resize(people, description.subjects.front());
  for (std::size_t i = 0; i < people; ++i) description.subjects[i].name = "person " + std::to_string(i);
  TakeMeter meter;
  meter.describe(description);
  v1::Snapshot snapshot;
  snapshot.set_number(1);
  meter.add(snapshot);
  return meter.report();
}

inline TakeInfo example_end(std::uint64_t sets) {
  TakeInfo info = example_start().info;
  info.ended_at = example_time(sets);
  info.end_timecode = "10:00:05:00";
  return info;
}

inline void record_example(const std::filesystem::path& path, std::uint64_t sets, mcap::WriterSettings settings = {}) {
  settings.sync = false;
  auto writer = TakeWriter::create(path, example_start(), settings);
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE(append_example(**writer, 0, sets));
  const Status finished = (*writer)->finish(example_end(sets));
  ASSERT_TRUE(finished) << finished.error().message;
}

inline bool is_same(const BlobFrame& a, const BlobFrame& b) {
  v1::CameraBlobs left, right;
  wire::encode(a, left);
  wire::encode(b, right);
  return left.SerializeAsString() == right.SerializeAsString();
}

// What a reader found in an example take.
struct ExampleContent {
  std::set<std::uint64_t> snapshots;
  std::set<std::uint64_t> blobs[kExampleCameras];
  std::size_t descriptions = 0;
  std::size_t wrong = 0;   // messages that differ from what was written
  std::size_t errors = 0;  // of the reader
  std::string first_error;
  Timestamp last_at;

  // All sets from 0 to the last one are there.
  bool has_no_gap() const {
    const auto whole = [](const std::set<std::uint64_t>& numbers) {
      return numbers.empty() || *numbers.rbegin() + 1 == numbers.size();
    };
    return whole(snapshots) && whole(blobs[0]) && whole(blobs[1]);
  }
};

inline std::string message_of(const Snapshot& snapshot, Duration utc_minus_host) {
  v1::Snapshot message;
  wire::encode(snapshot, message);
  message.set_utc_minus_host_ns(utc_minus_host.count());
  return message.SerializeAsString();
}

inline void take_record(const TakeRecord& record, const TakeInfo& info, ExampleContent& content) {
  content.last_at = std::max(content.last_at, record.at);
  if (record.topic == TakeTopic::Snapshot) {
    const auto snapshot = snapshot_of(record);
    const bool right = snapshot && record.at == example_time(snapshot->number) &&
                       record.bytes == message_of(example_snapshot(snapshot->number), info.utc_minus_host);
    if (right) content.snapshots.insert(snapshot->number);
    if (!right) ++content.wrong;
  } else if (record.topic == TakeTopic::Blobs) {
    const auto frame = blobs_of(record);
    const std::uint32_t camera = frame ? frame->camera.value : kExampleCameras;
    const bool right = camera < kExampleCameras && record.at == frame->exposed_at &&
                       is_same(*frame, example_blobs(camera, frame->number - 10 * camera));
    if (right) content.blobs[camera].insert(frame->number - 10 * camera);
    if (!right) ++content.wrong;
  } else if (record.topic == TakeTopic::Description) {
    ++content.descriptions;
  }
}

inline ExampleContent read_example(const TakeReader& reader) {
  ExampleContent content;
  TakeCursor cursor = reader.messages();
  Timestamp before{};
  for (;;) {
    const auto record = cursor.next();
    if (!record) {
      if (content.errors++ == 0) content.first_error = record.error().message;
      continue;
    }
    if (!*record) return content;
    if ((*record)->at < before) ++content.wrong;
    before = (*record)->at;
    take_record(**record, reader.info(), content);
  }
}

}  // namespace mocap::take
