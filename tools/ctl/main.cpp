// mocapctl: makes and shows what the daemon is told of subjects. See --help.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "base/exit_codes.h"
#include "ctl/subject_command.h"

namespace {

constexpr const char* kExamples = R"(examples:
  mocapctl subject import static.c3d --name anna --static --out subjects
                                  a marker set of the file's labels, and the body fitted to the static trial
  mocapctl subject fit --c3d walk.c3d --rest static.c3d --marker-set subjects/anna.markers.toml --out anna.toml
  mocapctl subject fit --stream take.jsonl --rest-s 2 --marker-set config/markersets/baseline41.toml --out anna.toml
                                  from what mocap-watch --json or [record] wrote; the first 2 s are a T-pose
  mocapctl subject show anna.toml bones, lengths and residuals

exit codes: 0 done, 64 wrong command line, 65 a recording that tells too little or cannot be read, 69 a file cannot be
written, 78 wrong marker set, skeleton or subject file)";

}  // namespace

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  CLI::App app{"mocapctl: makes and shows what the daemon is told of subjects", "mocapctl"};
  app.footer(kExamples);
  app.require_subcommand(1);
  ctl::SubjectOptions options;
  ctl::add_subject_command(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  }
  try {
    return options.run(options);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "mocapctl: %s\n", exception.what());
    return kExitSoftware;
  }
}
