#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>

#include "base/expects.h"
#include "clients/messages.h"
#include "feed.h"

// Messages that a hostile feed could send to the C client: good ones with bytes changed, cut, doubled and joined, and
// plain noise, each in memory of its own that ends with its last byte. Whatever the client then hands out is finite and
// fits its description.
//
// usage: client_fuzz [SECONDS [SEED]]

namespace mocap::client {
namespace {

std::size_t below(std::mt19937_64& random, std::size_t end) { return end == 0 ? 0 : random() % end; }

std::string good(std::mt19937_64& random) {
  switch (below(random, 5)) {
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

std::string spoilt(std::mt19937_64& random) {
  std::string message = good(random);
  const std::size_t head = message.find('\0') + 1;
  for (std::size_t times = below(random, 6); times > 0 && message.size() > head; --times) {
    const std::size_t place = head + below(random, message.size() - head);
    switch (below(random, 5)) {
      case 0: message[place] = static_cast<char>(random()); break;
      case 1:
        message[place] = static_cast<char>(static_cast<unsigned char>(message[place]) ^ (1U << below(random, 8)));
        break;
      case 2: message.resize(place); break;
      case 3: message.insert(place, message, place, below(random, 40)); break;
      default: message += good(random).substr(head);
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
  const double seconds = argc > 1 ? std::atof(argv[1]) : 3.0;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  std::mt19937_64 random(seed);
  Feed feed({"tcp://127.0.0.1:5570", "snapshot", MOCAP_AXES_UNREAL, 4, 1, false});
  feed.note({.connected = true, .connections = 1});
  Frame frame;
  unsigned long tries = 0;
  unsigned long frames = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  for (; std::chrono::steady_clock::now() < end; ++tries) {
    const std::string message = spoilt(random);
    // A copy that ends with its last byte: what reads past it is found by the address sanitizer.
    const std::unique_ptr<char[]> exact(new char[message.size()]);
    message.copy(exact.get(), message.size());
    const Now now{static_cast<std::int64_t>(tries) * 1'000'000,
                  static_cast<std::int64_t>(random() % 3'000'000'000'000'000'000)};
    feed.take({exact.get(), message.size()}, now);
    if (feed.hand_out(frame, now)) {
      ++frames;
      check(frame);
    }
    if (tries % 64 == 0) feed.diagnose(now);
  }
  std::printf("client_fuzz: %lu messages, %lu frames, seed %llu\n", tries, frames,
              static_cast<unsigned long long>(seed));
  return frames > 0 ? 0 : 1;
}
