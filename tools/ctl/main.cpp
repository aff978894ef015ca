// mocapctl: subjects, cameras, keys, the machine that they are on, and the daemon that runs there. See --help.
#include <cstdio>
#include <exception>
#include <functional>

#include "base/exit_codes.h"
#include "ctl/cameras_command.h"
#include "ctl/doctor_command.h"
#include "ctl/keys_command.h"
#include "ctl/live_command.h"
#include "ctl/subject_command.h"
#include "lib/cli/app.h"

namespace {

constexpr const char* kExamples = R"(examples:
  mocapctl subject import static.c3d --name anna --static --out subjects
                                  a marker set of the file's labels, and the body fitted to the static trial
  mocapctl subject fit --c3d walk.c3d --rest static.c3d --marker-set subjects/anna.markers.toml --out anna.toml
  mocapctl subject fit --stream take.jsonl --rest-s 2 --marker-set config/markersets/baseline41.toml --out anna.toml
                                  from what mocap-watch --json or [record] wrote; the first 2 s are a T-pose
  mocapctl subject show anna.toml bones, lengths and residuals
  mocapctl cameras list           the cameras that answer on the network, the USB and in the kernel
  mocapctl cameras describe 192.168.10.2
                                  its features, their values and ranges; what features = { ... } may name
  mocapctl cameras shot north-east --config mocapd.toml --out north-east.png
                                  one image with its blobs drawn in (mocapd must not have the camera)
  mocapctl doctor --config mocapd.toml
                                  what this machine lacks for these cameras, and the commands that mend it
  mocapctl status                 how the daemon on this machine is; --json for programs
  mocapctl subject reset anna     the running daemon forgets where anna is and how she measures
  mocapctl capture stop           let the cameras rest
  mocapctl keys new server.key    keys for a daemon that other machines reach; see mocapctl keys --help
  source <(mocapctl completion)   let bash complete all that

exit codes: 0 done, 64 wrong command line, 65 a recording that tells too little or cannot be read, 69 a file cannot be
written or the daemon did not answer, 77 not allowed to your role, 78 wrong marker set, skeleton or subject file)";

}  // namespace

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  cli::App app{"mocapctl: subjects, cameras, keys, this machine, and the daemon that runs", "mocapctl"};
  app.footer(kExamples);
  app.require_subcommand(1);
  ctl::SubjectOptions options;
  ctl::add_subject_command(app, options);
  std::function<int()> chosen;
  ctl::add_cameras_command(app, chosen);
  ctl::add_doctor_command(app, chosen);
  ctl::KeysOptions keys;
  ctl::add_keys_command(app, keys);
  ctl::LiveOptions live;
  ctl::add_live_commands(app, live);
  ctl::add_completion_command(app, chosen);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  try {
    for (const auto& run : {keys.run, live.run, chosen}) {
      if (run) return run();
    }
    return options.run(options);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "mocapctl: %s\n", exception.what());
    return kExitSoftware;
  }
}
