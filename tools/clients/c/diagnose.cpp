// The second part of class Feed: finds the reason why no data arrives, and words it for an operator.
#include <algorithm>

#include "feed.h"

namespace mocap::client {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kSilence_ns = kSecond_ns;
constexpr std::int64_t kDescribed_ns = 3 * kSecond_ns / 2;  // the daemon repeats the description once a second
// Plausible range of the transit time of a message: not negative, except for the time between two readings of UTC, and
// below half a second.
constexpr std::int64_t kMaxAhead_ns = 20'000'000;
constexpr std::int64_t kMaxTransit_ns = kSecond_ns / 2;

// The camera delivers no images, as an operator or the end of its recording wants.
bool rests(const mocap_camera_health& camera) {
  return camera.phase == MOCAP_CAMERA_ENDED || camera.phase == MOCAP_CAMERA_STOPPED;
}

}  // namespace

std::int32_t diagnosis_of(wire::LinkFault fault) {
  switch (fault) {
    case wire::LinkFault::NothingListens: return MOCAP_NOTHING_LISTENS;
    case wire::LinkFault::NotADaemon:
    case wire::LinkFault::ClosedByPeer: return MOCAP_NOT_A_FEED;
    case wire::LinkFault::KeyMissing:
    case wire::LinkFault::KeyNotWanted: return MOCAP_KEY_MISSING;
    case wire::LinkFault::KeyRefused: return MOCAP_KEY_REFUSED;
    case wire::LinkFault::ServerKeyWrong: return MOCAP_SERVER_KEY_WRONG;
    case wire::LinkFault::None: break;
  }
  return MOCAP_CONNECTING;
}

Diagnosis Feed::why_not_connected() const {
  wire::LinkFault fault = link_.fault;
  if (fault == wire::LinkFault::None && link_.connections > 0) fault = wire::LinkFault::NothingListens;
  if (fault == wire::LinkFault::None) return {MOCAP_CONNECTING, "connecting to " + settings_.endpoint};
  return {diagnosis_of(fault), wire::explain(fault, settings_.endpoint, words_of("[publish] endpoint"))};
}

std::string Feed::cameras_without_images() const {
  std::string names;
  if (!health_) return names;
  for (const mocap_camera_health& camera : health_->cameras) {
    if (camera.phase == MOCAP_CAMERA_STREAMING || rests(camera)) continue;
    names += (names.empty() ? "" : ", ") + std::string(camera.name);
    if (*camera.last_error != '\0') names += " (" + std::string(camera.last_error) + ")";
  }
  return names;
}

bool Feed::capture_ended() const {
  return health_ && std::any_of(health_->cameras.begin(), health_->cameras.end(), rests);
}

// The daemon's reasons why subjects are not found.
std::string Feed::missing_subjects() const {
  std::string reasons;
  if (!health_) return reasons;
  for (const std::string& reason : health_->searches) reasons += (reasons.empty() ? "" : "; ") + reason;
  return reasons;
}

bool Feed::skewed(Now now) const {
  if (transit_ns_ == MOCAP_ABSENT || transit_before_ns_ == MOCAP_ABSENT) return false;
  if (now.host_ns - transit_since_ns_ > 2 * kSecond_ns) return false;
  return transit_before_ns_ < -kMaxAhead_ns || transit_before_ns_ > kMaxTransit_ns;
}

Diagnosis Feed::why_no_snapshots(Now now) const {
  const std::string& at = settings_.endpoint;
  const std::int64_t connected_ns = now.host_ns - link_.since_ns;
  if (!foreign_protocol_.empty()) {
    return {MOCAP_VERSION_TOO_NEW, at + " speaks protocol " + foreign_protocol_ +
                                       ", this client mocap.v1: update this client, or the daemon if it is older"};
  }
  if (!description_) {
    if (connected_ns < kDescribed_ns) return {MOCAP_CONNECTING, "connected to " + at + ", waiting for its description"};
    return {MOCAP_NO_DESCRIPTION, at + " sends no description" +
                                      (last_fault_ == nullptr ? std::string() : std::string(" (") + last_fault_ + ")") +
                                      ": is it the feed of a mocapd, and not its control port?"};
  }
  if (const std::string names = cameras_without_images(); !names.empty()) {
    return {MOCAP_CAMERAS_SILENT,
            "no images from " + names + ": check power, cables and network of these cameras, then the daemon's log"};
  }
  const bool ended = capture_ended();
  if (!ended && connected_ns < kSilence_ns)
    return {MOCAP_CONNECTING, "connected to " + at + ", waiting for a snapshot"};
  std::string why = "no snapshots on topic '" + settings_.topic + "' from " + at;
  if (ended)
    return {MOCAP_NO_SNAPSHOTS, why + ": the capture there was stopped, or its recording has ended; start it again"};
  if (last_fault_ != nullptr) why += std::string(" (") + last_fault_ + ")";
  return {MOCAP_NO_SNAPSHOTS, why + ": check the topic, and the daemon's log"};
}

Diagnosis Feed::diagnose(Now now) const {
  if (!link_.connected) return why_not_connected();
  if (last_frame_ns_ == 0 || now.host_ns - last_frame_ns_ > kSilence_ns || !foreign_protocol_.empty()) {
    return why_no_snapshots(now);
  }
  if (const std::string names = cameras_without_images(); !names.empty()) {
    return {MOCAP_CAMERAS_SILENT,
            "no images from " + names + ": check power, cables and network of these cameras, then the daemon's log"};
  }
  if (skewed(now)) {
    return {MOCAP_CLOCK_SKEW, "the clock of " + settings_.endpoint + " is " +
                                  std::to_string(-transit_before_ns_ / 1'000'000) +
                                  " ms ahead of this machine's: synchronise both with one time server (chrony or PTP)"};
  }
  const std::string missing = missing_subjects();
  if (any_subject_ && !tracking_) {
    if (!missing.empty()) return {MOCAP_SUBJECT_SEARCHING, missing};
    return {MOCAP_SUBJECT_SEARCHING,
            "snapshots arrive, but no subject is identified: stand in T-pose in view of three cameras, check the "
            "marker set"};
  }
  if (!any_subject_ && !description_->subjects.empty()) {
    return {MOCAP_SUBJECT_SEARCHING, "snapshots arrive without a subject: check the subject's name in the topic"};
  }
  return {MOCAP_WELL, missing.empty() ? "all is well" : "all is well, but " + missing};
}

}  // namespace mocap::client
