// Feed's second idea: why no data comes, in words that help.
#include <algorithm>

#include "feed.h"

namespace mocap::client {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kSilence_ns = kSecond_ns;
constexpr std::int64_t kDescribed_ns = 3 * kSecond_ns / 2;  // the description is sent again once a second
// A message is never here before it was sent, save that UTC is read a moment apart; nor does it take half a second.
constexpr std::int64_t kMaxAhead_ns = 20'000'000;
constexpr std::int64_t kMaxTransit_ns = kSecond_ns / 2;

}  // namespace

Diagnosis Feed::why_not_connected() const {
  const std::string& at = settings_.endpoint;
  switch (link_.handshake) {
    case MOCAP_KEY_MISSING:
      if (settings_.has_keys) {
        return {MOCAP_KEY_MISSING,
                at + " takes no keys and we have some: leave them out, or set [security] server_key there"};
      }
      return {MOCAP_KEY_MISSING,
              at + " wants a key: make one with 'mocapctl keys new', allow it there, and give it to this client"};
    case MOCAP_KEY_REFUSED:
      return {MOCAP_KEY_REFUSED,
              at + " does not know our public key: allow it there with 'mocapctl keys allow', or it was revoked"};
    case MOCAP_SERVER_KEY_WRONG:
      return {MOCAP_SERVER_KEY_WRONG, at + " is not who our server key says: take the public key in the file that "
                                           "[security] server_key names there"};
    case MOCAP_NOT_A_FEED:
      return {MOCAP_NOT_A_FEED, "who listens at " + at + " is no mocapd: check the port against [publish] endpoint"};
    default: break;
  }
  if (link_.refused > 0 || link_.connections > 0) {
    return {MOCAP_NOTHING_LISTENS,
            "nothing listens at " + at + ": start mocapd, or check address and port against [publish] endpoint"};
  }
  return {MOCAP_CONNECTING, "connecting to " + at};
}

std::string Feed::cameras_without_images() const {
  std::string names;
  for (const CameraNews& camera : health_.cameras) {
    if (camera.streaming || camera.ended || camera.stopped) continue;
    names += (names.empty() ? "" : ", ") + camera.name;
    if (!camera.last_error.empty()) names += " (" + camera.last_error + ")";
  }
  return names;
}

bool Feed::skewed(Now now) const {
  if (transit_ns_ == MOCAP_ABSENT || transit_before_ns_ == MOCAP_ABSENT) return false;
  if (now.host_ns - transit_since_ns_ > 2 * kSecond_ns) return false;
  return transit_before_ns_ < -kMaxAhead_ns || transit_before_ns_ > kMaxTransit_ns;
}

Diagnosis Feed::why_nothing_comes(Now now) const {
  const std::string& at = settings_.endpoint;
  const std::int64_t connected_ns = now.host_ns - link_.since_ns;
  if (!foreign_protocol_.empty()) {
    return {MOCAP_VERSION_TOO_NEW, at + " speaks protocol " + foreign_protocol_ +
                                       ", this client mocap.v1: update this client, or the daemon if it is the older"};
  }
  if (!description_) {
    if (connected_ns < kDescribed_ns) return {MOCAP_CONNECTING, "connected to " + at + ", waiting for its description"};
    return {MOCAP_NO_DESCRIPTION, at + " never says what it sends" +
                                      (last_fault_ == nullptr ? std::string() : std::string(" (") + last_fault_ + ")") +
                                      ": is it a mocapd's feed, and not its control port?"};
  }
  if (const std::string names = cameras_without_images(); !names.empty()) {
    return {MOCAP_CAMERAS_SILENT,
            "no images from " + names + ": check power, cables and network of these cameras, then the daemon's log"};
  }
  const bool ended = std::any_of(health_.cameras.begin(), health_.cameras.end(),
                                 [](const CameraNews& camera) { return camera.ended || camera.stopped; });
  if (!ended && connected_ns < kSilence_ns)
    return {MOCAP_CONNECTING, "connected to " + at + ", waiting for a snapshot"};
  std::string why = "no snapshots on topic '" + settings_.topic + "' from " + at;
  if (ended)
    return {MOCAP_NO_SNAPSHOTS, why + ": capture was stopped there, or its recording has ended; start it again"};
  if (last_fault_ != nullptr) why += std::string(" (") + last_fault_ + ")";
  return {MOCAP_NO_SNAPSHOTS, why + ": check the topic, and the daemon's log"};
}

Diagnosis Feed::diagnose(Now now) const {
  if (!link_.connected) return why_not_connected();
  if (last_frame_ns_ == 0 || now.host_ns - last_frame_ns_ > kSilence_ns || !foreign_protocol_.empty()) {
    return why_nothing_comes(now);
  }
  if (const std::string names = cameras_without_images(); !names.empty()) {
    return {MOCAP_CAMERAS_SILENT,
            "no images from " + names + ": check power, cables and network of these cameras, then the daemon's log"};
  }
  if (skewed(now)) {
    return {MOCAP_CLOCK_SKEW, "the clock of " + settings_.endpoint + " is " +
                                  std::to_string(-transit_before_ns_ / 1'000'000) +
                                  " ms ahead of ours: let both follow one time server (chrony or PTP)"};
  }
  if (any_subject_ && !tracking_) {
    return {MOCAP_SUBJECT_SEARCHING,
            "snapshots come and nobody is recognised: stand in T-pose in view of three cameras, check the marker set"};
  }
  if (!any_subject_ && !description_->subjects.empty()) {
    return {MOCAP_SUBJECT_SEARCHING, "snapshots come without a subject: check the subject's name in the topic"};
  }
  return {MOCAP_WELL, "all is well"};
}

}  // namespace mocap::client
