// mocapctl: manages subjects, cameras, keys and takes, checks the machine, and controls a running daemon. See --help.
#include <cstdio>
#include <exception>
#include <functional>

#include "base/exit_codes.h"
#include "ctl/audit/audit_command.h"
#include "ctl/bridge_command.h"
#include "ctl/camera/cameras_command.h"
#include "ctl/camera/nodes_command.h"
#include "ctl/config_command.h"
#include "ctl/doctor_command.h"
#include "ctl/keys_command.h"
#include "ctl/live/calibrate_command.h"
#include "ctl/live/live_command.h"
#include "ctl/preflight_command.h"
#include "ctl/subject/subject_command.h"
#include "ctl/take/export_command.h"
#include "ctl/take/join_command.h"
#include "ctl/take/retrack_command.h"
#include "ctl/take/take_command.h"
#include "lib/cli/app.h"

namespace {

constexpr const char* kExamples = R"(examples:
  mocapctl subject import static.c3d --name anna --static --out subjects
      a marker set of the file's labels, and the body fitted to the static trial
  mocapctl subject fit --c3d walk.c3d --rest static.c3d \
      --marker-set subjects/anna.markers.toml --out anna.toml
  mocapctl subject fit --stream take.jsonl --rest-s 2 \
      --marker-set config/markersets/baseline41.toml --out anna.toml
      from what mocap-watch --json or [record] wrote; the first 2 s are a T-pose
  mocapctl subject show anna.toml
      bones, lengths and residuals
  mocapctl subject draw config/markersets/baseline41.toml --out baseline41.svg
      where the markers go, seen from the front and from the back
  mocapctl cameras list
      the cameras that answer on the network, the USB and in the kernel
  mocapctl cameras describe 192.168.10.2
      its features, their values and ranges; what features = { ... } may name
  mocapctl cameras shot north-east --config mocapd.toml --out north-east.png
      one image with its blobs drawn in (mocapd must not have the camera)
  mocapctl nodes
      the camera nodes that announce themselves, and whether they answer
  mocapctl doctor --config mocapd.toml
      what this machine lacks for these cameras, and the commands that mend it
  mocapctl preflight
      whether the running daemon is ready to record, and what mends what is not
  mocapctl config show
      every setting of the service, and the file it comes from
  mocapctl audit --since 2h
      who connected, ordered, recorded and changed what
  mocapctl status
      how the daemon on this machine is; --json for programs
  mocapctl subject reset anna
      the running daemon forgets where anna is and how she measures
  mocapctl capture stop
      let the cameras rest
  mocapctl take start walk --before 20
      record, beginning 20 s ago; take stop ends it
  mocapctl take show takes/walk-3.mcap
      length, topics, rates, notes; take --help: verify, repair, note, rename
  mocapctl take retrack takes/walk-3.mcap --rig mended-rig.toml --out walk-3b.mcap
      tracked again from its blobs, as the daemon does
  mocapctl take export takes/walk-3.mcap --out walk.fbx
      as C3D, TRC, CSV, BVH, glTF, USD or FBX; see take export --help
  mocapctl calibrate wand --wand 500
      the running daemon calibrates its cameras with a waved wand
  mocapctl bridge list
      who receives the feed by NatNet, VRPN, Rokoko, VMC or NATS
  mocapctl keys new server.key
      keys for a daemon that other machines reach; see mocapctl keys --help

exit codes: 0 done, 64 wrong command line, 65 a recording that tells too little
or cannot be read, a wrong key file, or a request that the daemon finds wrong,
66 no such file, 69 the daemon or a camera did not answer, 73 a file cannot be
written, 77 not allowed to your role, 78 wrong configuration, marker set,
skeleton or subject file)";

}  // namespace

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  cli::App app{"mocapctl: manages subjects, cameras and keys, checks this machine, and controls the running daemon",
               "mocapctl"};
  app.footer(kExamples);
  app.require_subcommand(1);
  ctl::SubjectOptions options;
  ctl::add_subject_command(app, options);
  std::function<int()> chosen;
  ctl::add_cameras_command(app, chosen);
  ctl::add_nodes_command(app, chosen);
  ctl::add_bridge_command(app, chosen);
  ctl::add_doctor_command(app, chosen);
  ctl::add_preflight_command(app, chosen);
  ctl::add_config_command(app, chosen);
  ctl::add_audit_command(app, chosen);
  ctl::KeysOptions keys;
  ctl::add_keys_command(app, keys);
  ctl::TakeOptions takes;
  ctl::add_take_command(app, takes);
  ctl::add_export_command(*app.get_subcommand("take"), chosen);
  ctl::add_retrack_command(*app.get_subcommand("take"), chosen);
  ctl::add_join_command(*app.get_subcommand("take"), chosen);
  ctl::LiveOptions live;
  ctl::add_live_commands(app, live);
  ctl::LiveOptions calibration;
  calibration.seconds = 180.0;
  ctl::add_calibrate_command(app, calibration);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  try {
    for (const auto& run : {keys.run, takes.run, live.run, calibration.run, chosen}) {
      if (run) return run();
    }
    return options.run(options);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "mocapctl: %s\n", exception.what());
    return kExitSoftware;
  }
}
