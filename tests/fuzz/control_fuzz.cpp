#include <google/protobuf/stubs/logging.h>

#include <random>
#include <string>

#include "base/expects.h"
#include "fuzz/damage.h"
#include "fuzz/fuzz_arguments.h"
#include "fuzz/message.h"
#include "mocap/v1/control.pb.h"
#include "support/typical_snapshot.h"
#include "wire/codec/control_codec.h"
#include "wire/codec/decode.h"
#include "wire/codec/encode.h"

// Fuzzes the decoders with messages of untrusted clients: requests with random fields, snapshots and descriptions with
// a few wrong fields, random health, and bytes that are damaged, removed or added. Each message must be decoded within
// its bounds or rejected with a reason.
//
// usage: control_fuzz [COUNT [SEED]]

namespace mocap::wire {
namespace {

class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed) : random_(seed) {
    const Description description = support::typical_description({.markers = 12, .bones = 5, .cameras = 3});
    description_ = encode(description);
    encode(support::typical_snapshot(description), snapshot_);
  }

  void try_once() {
    v1::Request request;
    messages_.fill(request);
    check(decode(request));
    if (request.ParseFromString(fuzz::damaged(request.SerializePartialAsString(), random_))) check(decode(request));
    try_feed();
  }

 private:
  // Decodes messages of the feed.
  void try_feed() {
    v1::Snapshot snapshot = snapshot_;
    v1::Description description = description_;
    for (auto i = random_() % 3; i > 0; --i) {
      messages_.damage(snapshot);
      messages_.damage(description);
    }
    check(decode(snapshot));
    check(decode(description));
    v1::Health health;
    messages_.fill(health);
    check(decode(health));
  }

  template <class Message>
  static void check(const Result<Message>& read) {
    MOCAP_EXPECTS(read || !read.error().message.empty());
  }

  static void check(const Result<ControlRequest>& read) {
    if (!read) {
      MOCAP_EXPECTS(read.error().code == ErrorCode::InvalidArgument && !read.error().message.empty());
      return;
    }
    MOCAP_EXPECTS(read->name.size() <= 255);
    MOCAP_EXPECTS(!read->exposure_us || (*read->exposure_us >= 1.0 && *read->exposure_us <= 1e6));
    MOCAP_EXPECTS(!read->gain_db || (*read->gain_db >= 0.0 && *read->gain_db <= 60.0));
    MOCAP_EXPECTS(read->rest_offsets_m.size() <= kMaxBones && read->marker_offsets_m.size() <= kMaxLabels);
    for (const auto& offset : read->rest_offsets_m) MOCAP_EXPECTS(offset.allFinite());
    MOCAP_EXPECTS(decode(encode(*read)).has_value());
  }

  std::mt19937_64 random_;
  fuzz::MessageFuzz messages_{random_};
  v1::Snapshot snapshot_;
  v1::Description description_;
};

}  // namespace
}  // namespace mocap::wire

int main(int argc, char** argv) {
  google::protobuf::SetLogHandler(nullptr);
  const mocap::fuzz::Arguments arguments(argc, argv);
  mocap::wire::Fuzz fuzz(arguments.seed);
  for (std::uint64_t i = 0; i < arguments.count; ++i) fuzz.try_once();
  arguments.print("requests");
  return 0;
}
