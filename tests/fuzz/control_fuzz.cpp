#include <google/protobuf/stubs/logging.h>

#include <cmath>
#include <random>
#include <string>

#include "base/expects.h"
#include "fuzz/damage.h"
#include "fuzz/fuzz_arguments.h"
#include "mocap/v1/control.pb.h"
#include "wire/codec/control_codec.h"
#include "wire/codec/decode.h"

// Fuzzes the decoders with requests of untrusted clients: random bytes, and valid requests with bytes damaged, removed
// or added. Each request must be decoded within its bounds or rejected with a reason. Also decodes damaged messages of
// the feed.
//
// usage: control_fuzz [COUNT [SEED]]

namespace mocap::wire {
namespace {

class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed) : random_(seed) {}

  void try_once() {
    const std::string bytes = below(8) == 0 ? fuzz::random_bytes(random_) : fuzz::damaged(valid_request(), random_);
    v1::Request request;
    if (request.ParseFromString(bytes)) check(decode(request));
    v1::Snapshot snapshot;
    if (snapshot.ParseFromString(fuzz::damaged(valid_snapshot(), random_))) static_cast<void>(decode(snapshot));
    v1::Description description;
    if (description.ParseFromString(bytes)) static_cast<void>(decode(description));
    v1::Health health;
    if (health.ParseFromString(bytes)) static_cast<void>(decode(health));
  }

 private:
  int below(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }
  double number() {
    switch (below(6)) {
      case 0: return std::nan("");
      case 1: return HUGE_VAL;
      case 2: return -1e300;
      default: return below(2000) * 0.01 - 10.0;
    }
  }

  std::string valid_request() {
    v1::Request request;
    request.set_id(random_());
    switch (below(9)) {
      case 0: request.mutable_status(); break;
      case 1: request.mutable_description(); break;
      case 2: request.mutable_snapshot(); break;
      case 3: request.mutable_reload(); break;
      case 4: request.mutable_capture()->set_action(static_cast<v1::CaptureRequest::Action>(below(4))); break;
      case 5:
        request.mutable_mask()->set_images(static_cast<std::uint32_t>(random_()));
        request.mutable_mask()->set_camera("north");
        break;
      case 6:
        request.mutable_camera()->set_name("north");
        request.mutable_camera()->set_exposure_us(number());
        if (below(2) == 0) request.mutable_camera()->set_gain_db(number());
        break;
      default: {
        v1::SubjectRequest& subject = *request.mutable_subject();
        subject.set_action(static_cast<v1::SubjectRequest::Action>(below(6)));
        subject.set_name(std::string(static_cast<std::size_t>(below(300)), 'a'));
        for (int i = below(3 * static_cast<int>(kMaxBones) + 9); i > 0; --i) subject.add_rest_offsets_m(number());
        for (int i = below(30); i > 0; --i) subject.add_marker_offsets_m(number());
        subject.set_residual_m(number());
      }
    }
    return request.SerializeAsString();
  }

  std::string valid_snapshot() {
    v1::Snapshot snapshot;
    snapshot.mutable_instants()->set_exposed_at_ns(1);
    v1::SubjectState& subject = *snapshot.add_subjects();
    for (int i = below(5); i > 0; --i) {
      subject.mutable_markers()->add_states(static_cast<v1::MarkerState>(below(4)));
      for (int k = 0; k < 3; ++k) subject.mutable_markers()->add_positions_m(static_cast<float>(number()));
      subject.mutable_markers()->add_cameras(3);
      subject.mutable_markers()->add_confidences_percent(90);
      subject.mutable_markers()->add_track_ids_plus_one(7);
    }
    for (int i = below(4); i > 0; --i) snapshot.mutable_views()->add_cameras(static_cast<std::uint32_t>(below(70)));
    return snapshot.SerializeAsString();
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
