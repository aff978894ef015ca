#include "lib/cli/commands.h"

#include <cstdio>
#include <string_view>

#include "base/exit_codes.h"
#include "lib/cli/app.h"

namespace mocap::cli {
namespace {

void print_usage(std::FILE* to, const Program& program) {
  std::fprintf(to, "usage: %s COMMAND [options]    (COMMAND --help)\n\n", program.name);
  for (const Command& command : program.commands) std::fprintf(to, "  %-10s %s\n", command.name, command.summary);
}

}  // namespace

int run_command(const Program& program, int argc, const char* const* argv) {
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first == "--help" || first == "-h") {
    std::fprintf(stdout, "%s: %s\n", program.name, program.about);
    print_usage(stdout, program);
    std::fprintf(stdout, "\n%s\n", program.examples);
    return kExitOk;
  }
  if (first == "--version") {
    std::printf("%s\n", version_of(program.name).c_str());
    return kExitOk;
  }
  for (const Command& command : program.commands) {
    if (first == command.name) return command.run(argc - 1, argv + 1);
  }
  if (first.starts_with("--")) return program.commands.front().run(argc, argv);
  if (!first.empty()) std::fprintf(stderr, "%s: unknown command '%s'\n", program.name, argv[1]);
  print_usage(stderr, program);
  return kExitUsage;
}

}  // namespace mocap::cli
