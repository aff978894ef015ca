// mocap-eval: how right is what the daemon says?
#include <cstdio>
#include <string_view>

#include "eval/command.h"

namespace {

constexpr int kUsage = 64;  // sysexits EX_USAGE

void print_usage(std::FILE* to) {
  std::fputs("usage: mocap-eval COMMAND [options]    (mocap-eval COMMAND --help tells them)\n\n", to);
  for (const auto& command : mocap::eval::commands()) std::fprintf(to, "  %-10s %s\n", command.name, command.summary);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first == "--help" || first == "-h") {
    print_usage(stdout);
    return 0;
  }
  for (const auto& command : mocap::eval::commands()) {
    if (first == command.name) return command.run(argc - 1, argv + 1);
  }
  if (first.starts_with("--")) return mocap::eval::commands().front().run(argc, argv);
  if (!first.empty()) std::fprintf(stderr, "mocap-eval: unknown command '%s'\n", argv[1]);
  print_usage(stderr);
  return kUsage;
}
