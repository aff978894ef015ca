#include "settings/sections.h"

namespace mocap::settings {
namespace {

constexpr std::vector<KeyFault> (*kNoRules)(const DaemonSettings&) = nullptr;

// A section whose keys all fill one field of DaemonSettings.
template <auto field>
void declare(KeyVisitor& keys, DaemonSettings& all) {
  declare_keys(keys, all.*field);
}

template <auto field>
std::vector<KeyFault> faults(const DaemonSettings& all) {
  return faults_of(all.*field);
}

void declare_capture(KeyVisitor& keys, DaemonSettings& all) {
  declare_keys(keys, all.capture);
  declare_capture_keys(keys, all.pipeline);
}

void declare_log(KeyVisitor& keys, DaemonSettings& all) {
  keys.choice<LogLevel>(
      "level", all.log_level,
      {{"debug", LogLevel::Debug}, {"info", LogLevel::Info}, {"warn", LogLevel::Warn}, {"error", LogLevel::Error}},
      {.help = "lines below this level are left out"});
}

void declare_align(KeyVisitor& keys, DaemonSettings& all) { declare_keys(keys, all.pipeline.align); }

void declare_publish(KeyVisitor& keys, DaemonSettings& all) {
  declare_keys(keys, all.publish);
  declare_publish_keys(keys, all.pipeline);
}

// The feed, the control endpoint and the node authenticate by the same keys.
void declare_security(KeyVisitor& keys, DaemonSettings& all) {
  declare_keys(keys, all.publish.curve);
  all.control.curve = all.publish.curve;
  all.node.curve = all.publish.curve;
}

std::vector<KeyFault> security_faults(const DaemonSettings& all) { return faults_of(all.publish.curve); }

void declare_reopen(KeyVisitor& keys, DaemonSettings& all) { declare_reopen_keys(keys, all.pipeline); }

std::vector<KeyFault> reopen_faults(const DaemonSettings& all) { return reopen_faults_of(all.pipeline); }

void declare_queues(KeyVisitor& keys, DaemonSettings& all) { declare_queues_keys(keys, all.pipeline); }

void declare_realtime(KeyVisitor& keys, DaemonSettings& all) { declare_realtime_keys(keys, all.pipeline); }

using All = DaemonSettings;

constexpr Section kSections[] = {
    {"capture", "the run as a whole", declare_capture, kNoRules},
    {"log", "", declare_log, kNoRules},
    {"detect", "bright spots in each image", declare<&All::detect>, faults<&All::detect>,
     "the pipeline: from image to skeleton"},
    {"track", "2D tracks in the images of one camera", declare<&All::track_blobs>, kNoRules},
    {"align", "images of all cameras at one instant", declare_align, kNoRules},
    {"match", "the views of one marker across cameras", declare<&All::match>, faults<&All::match>},
    {"triangulate", "the position of a marker", declare<&All::triangulate>, kNoRules},
    {"track_markers", "3D tracks in the volume", declare<&All::track_markers>, kNoRules},
    {"label", "the labels of the markers", declare<&All::label>, kNoRules},
    {"solve", "the skeleton", declare<&All::solve>, kNoRules},
    {"refine", "bodies are refitted while they are tracked", declare<&All::refine>, kNoRules},
    {"watch", "cameras that moved since the calibration; needs four cameras", declare<&All::drift>, kNoRules},
    {"publish", "the feed, over ZeroMQ", declare_publish, faults<&All::publish>, "output"},
    {"control", "requests of mocapctl to the running daemon, over ZeroMQ", declare<&All::control>,
     faults<&All::control>},
    {"node", "this daemon is a node: it needs no rig, and sends the blobs of its cameras to a fusion host",
     declare<&All::node>, faults<&All::node>},
    {"security", "who may connect to [publish], [control] and [node]: CURVE keys, see mocapctl keys --help",
     declare_security, security_faults},
    {"record", "recordings of the run; relative names are in the state folder of the service (/var/lib/mocapd)",
     declare<&All::record>, faults<&All::record>},
    {"takes",
     "takes, recorded when mocapctl take start asks for one; a relative folder is in the state folder of the service",
     declare<&All::takes>, faults<&All::takes>},
    {"trigger", "takes that other programs start and stop over UDP, and programs that record with this one",
     declare<&All::trigger>, faults<&All::trigger>},
    {"timecode", "the timecode of snapshots and takes; a replay has none", declare<&All::timecode>, kNoRules},
    {"ptp", "the clocks of nodes and of their fusion host, where linuxptp synchronises both", declare<&All::ptp>,
     kNoRules},
    {"reopen", "a camera that failed or fell silent; the others go on", declare_reopen, reopen_faults, "operation"},
    {"audit",
     "the log of connections, orders and changes; a relative name is in the state folder of the service "
     "(/var/lib/mocapd)",
     declare<&All::audit>, kNoRules},
    {"queues", "a full queue drops the new item and counts it", declare_queues, kNoRules},
    {"realtime", "threads and the operating system", declare_realtime, kNoRules},
};

}  // namespace

std::span<const Section> sections() { return kSections; }

}  // namespace mocap::settings
