#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <string>

#include "base/expects.h"
#include "clients/messages.h"
#include "decode.h"
#include "feed.h"
#include "fuzz/fuzz_arguments.h"
#include "mocap/v1/event.pb.h"
#include "mocap/v1/health.pb.h"

// Fuzzes the C client with messages of a hostile feed: valid messages with bytes changed, removed, repeated and joined,
// and random bytes. Each message is copied to a memory block of its exact size, so that the address sanitizer detects
// reads beyond its end. Every frame that the client returns must be finite and match its description.
//
// usage: client_fuzz [COUNT [SEED]]

namespace mocap::client {
namespace {

std::size_t below(std::mt19937_64& random, std::size_t end) { return end == 0 ? 0 : random() % end; }

v1::Health health_report(std::mt19937_64& random) {
  v1::Health said;
  for (std::size_t i = below(random, 4); i > 0; --i) said.add_cameras()->set_name("north");
  said.add_recordings()->set_path("take.jsonl");
  said.add_latencies()->set_stage(v1::LATENCY_STAGE_TOTAL);
  said.mutable_feed()->set_listeners(3);
  return said;
}

std::string valid_message(std::mt19937_64& random) {
  switch (below(random, 7)) {
    case 4: return testing::envelope("health", health_report(random));
    case 5: {
      v1::Event said;
      said.set_kind(v1::EVENT_KIND_SUBJECT_FOUND);
      said.set_subject(static_cast<std::uint32_t>(below(random, 3)));
      said.set_message(std::string(below(random, 600), 'e'));
      return testing::envelope("event", said);
    }
    case 0: return testing::description_message("mocap.v1", 1, below(random, 2) == 0 ? "a" : "b");
    case 1: return testing::two_bones_description();
    case 2: return testing::two_bones_snapshot({0, 0, 0, 1, 0, 0, 1, 0});
    case 3: return testing::snapshot_message(below(random, 100), static_cast<std::int64_t>(random()));
    default: {
      v1::Snapshot said = testing::snapshot({{"position", {0, 0, 1}}, {"rotation_xyzw", {0, 0, 0, 1}}});
      v1::LabelledMarkers& markers = *said.mutable_subjects(0)->mutable_markers();
      v1::UnlabelledMarkers& points = *said.mutable_unlabelled();
      for (std::size_t i = below(random, 4); i > 0; --i) {
        markers.add_states(v1::MARKER_STATE_MEASURED);
        for (int k = 0; k < 3; ++k) markers.add_positions_m(1.0F);
        for (int k = 0; k < 3; ++k) points.add_positions_m(2.0F);
        points.add_cameras(3);
      }
      return testing::envelope("snapshot", said);
    }
  }
}

// Bytes of the topic and its end.
std::size_t head_of(const std::string& message) { return message.find('\0') + 1; }

std::string damaged_message(std::mt19937_64& random) {
  std::string message = valid_message(random);
  const std::size_t head = head_of(message);
  for (std::size_t times = below(random, 6); times > 0 && message.size() > head; --times) {
    const std::size_t place = head + below(random, message.size() - head);
    switch (below(random, 5)) {
      case 0: message[place] = static_cast<char>(random()); break;
      case 1:
        message[place] = static_cast<char>(static_cast<unsigned char>(message[place]) ^ (1U << below(random, 8)));
        break;
      case 2: message.resize(place); break;
      case 3: message.insert(place, message, place, below(random, 40)); break;
      default: {
        const std::string joined = valid_message(random);
        message.append(joined, head_of(joined));
      }
    }
  }
  if (below(random, 8) == 0) {
    message.resize(head);
    for (std::size_t n = below(random, 300); n > 0; --n) message.push_back(static_cast<char>(random()));
  }
  return message;
}

bool finite(mocap_vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

void check(const Frame& frame) {
  MOCAP_EXPECTS(frame.description != nullptr && frame.subjects.size() == frame.info.subject_count);
  for (const SubjectFrame& subject : frame.subjects) {
    MOCAP_EXPECTS(subject.subject < frame.description->subjects.size());
    const SubjectDescription& known = frame.description->subjects[subject.subject];
    MOCAP_EXPECTS(subject.bones.empty() || subject.bones.size() == known.bones.size());
    MOCAP_EXPECTS(subject.markers.empty() || subject.markers.size() == known.markers.size());
    for (const mocap_bone_pose& bone : subject.bones) {
      const mocap_quat q = bone.local_rotation;
      MOCAP_EXPECTS(finite(bone.position) && finite(bone.local_position) && finite(bone.velocity) && finite(bone.spin));
      MOCAP_EXPECTS(std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0F) < 1e-3F);
    }
    for (const mocap_marker_pose& marker : subject.markers) MOCAP_EXPECTS(finite(marker.position));
  }
  for (const mocap_point& point : frame.points) MOCAP_EXPECTS(finite(point.position));
}

}  // namespace
}  // namespace mocap::client

int main(int argc, char** argv) {
  using namespace mocap::client;  // NOLINT: the program
  const mocap::fuzz::Arguments arguments(argc, argv);
  std::mt19937_64 random(arguments.seed);
  Feed feed({"tcp://127.0.0.1:5570", "snapshot", MOCAP_AXES_UNREAL, 4, 1});
  feed.note({.connected = true, .connections = 1});
  Frame frame;
  unsigned long frames = 0;
  for (std::uint64_t tries = 0; tries < arguments.count; ++tries) {
    const std::string message = damaged_message(random);
    // A copy in a block of the exact size: the address sanitizer detects reads beyond its end.
    const std::unique_ptr<char[]> exact(new char[message.size()]);
    message.copy(exact.get(), message.size());
    const Now now{static_cast<std::int64_t>(tries) * 1'000'000,
                  static_cast<std::int64_t>(random() % 3'000'000'000'000'000'000)};
    feed.take({exact.get(), message.size()}, now);
    if (feed.hand_out(frame, now)) {
      ++frames;
      check(frame);
    }
    mocap_event event;
    while (feed.next_event(event)) MOCAP_EXPECTS(std::memchr(event.message, 0, sizeof(event.message)) != nullptr);
    Answer answer;
    decode_answer({exact.get(), message.size()}, answer);
    decode_answer({exact.get() + message.find('\0') + 1, message.size() - message.find('\0') - 1}, answer);
    if (tries % 64 == 0) feed.diagnose(now);
  }
  arguments.print("messages");
  return frames > 0 ? 0 : 1;
}
