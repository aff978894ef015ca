#include "ctl/audit/audit_command.h"

#include <fmt/format.h>

#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>

#include "audit/audit_settings.h"
#include "base/exit_codes.h"
#include "ctl/audit/audit_log.h"
#include "lib/cli/shown_text.h"
#include "settings/state_folder.h"

namespace mocap::ctl {
namespace {

namespace fs = std::filesystem;

constexpr const char* kServiceState = "/var/lib/mocapd";  // of systemd/mocapd.service

struct AuditOptions {
  fs::path file;
  AuditFilter filter;
  bool json = false;
};

fs::path audit_file(const AuditOptions& options) {
  if (!options.file.empty()) return options.file;
  const fs::path own = settings::state_folder_of_service();
  return (own.empty() ? fs::path(kServiceState) : own) / audit::AuditSettings{}.file;
}

// A value of the log may have any characters.
void print_line(const AuditLine& line) {
  fmt::print("{}  {:<12}  {}", cli::shown(line.at), cli::shown(line.what), cli::shown(line.who));
  for (const auto& [name, value] : line.parts) fmt::print("  {}={}", cli::shown(name), cli::shown(value));
  fmt::print("\n");
}

int run_audit(const AuditOptions& options) {
  const fs::path file = audit_file(options);
  const auto damaged = read_audit(file, options.filter, [&](const AuditLine& line) {
    if (options.json) {
      fmt::print("{}\n", line.json);
    } else {
      print_line(line);
    }
  });
  if (!damaged) {
    std::error_code denied;
    fs::directory_iterator(file.parent_path(), denied);
    const bool forbidden = denied == std::errc::permission_denied || damaged.error().code == ErrorCode::Io;
    fmt::print(stderr, "mocapctl: {}; {}\n", damaged.error().message,
               forbidden ? "run mocapctl audit as root (sudo)" : "--file names the file of [audit]");
    return forbidden ? kExitNoPerm : kExitNoInput;
  }
  if (*damaged > 0) fmt::print(stderr, "mocapctl: {}: {} lines are damaged\n", file.string(), *damaged);
  return kExitOk;
}

}  // namespace

void add_audit_command(cli::App& app, std::function<int()>& chosen) {
  auto options = std::make_shared<AuditOptions>();
  cli::App* const audit =
      app.add_subcommand("audit", "who connected, ordered, recorded and changed what, and when (UTC)");
  audit->examples(R"(  mocapctl audit --since 2h
      the last two hours of the daemon on this machine, with the older files of the log
  mocapctl audit --who anna --what ordered
      the orders of the key anna, and of those who said that they ask for anna (states=anna)
  mocapctl audit --json --since 2026-11-26 --file audit.jsonl
      lines of JSON, for programs)");
  audit->add_option("--file", options->file, "the log; by default audit.jsonl in the state folder of the service")
      ->type_name("FILE");
  audit
      ->add_option(
          "--since",
          [options](const std::string& text) -> std::optional<std::string> {
            const auto since = since_text(text, static_cast<std::int64_t>(std::time(nullptr)));
            if (since) options->filter.since = *since;
            if (since) return std::nullopt;
            return "--since: '" + text + "' is no time, expected 90s, 30m, 2h, 7d or 2026-11-26T18:15:20Z (UTC)";
          },
          "from this time on: 90s, 30m, 2h, 7d ago, or a date in UTC")
      ->type_name("TIME");
  audit->add_option("--who", options->filter.who, "of this name, stated name, key or address")->type_name("NAME");
  audit
      ->add_option("--what", options->filter.what, "connected, disconnected, refused, ordered, recorded, retained, ...")
      ->type_name("WORD");
  audit->add_flag("--json", options->json, "print the lines as they are");
  audit->callback([options, &chosen] { chosen = [options] { return run_audit(*options); }; });
}

}  // namespace mocap::ctl
