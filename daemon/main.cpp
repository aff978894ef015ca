#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>

#include "assemble.h"
#include "base/exit_codes.h"
#include "base/log.h"
#include "runtime/pipeline.h"
#include "runtime/service.h"
#include "settings/daemon_settings.h"

namespace mocap {
namespace {

constexpr Duration kLookAround = std::chrono::milliseconds(100);

sigset_t block_end_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // before any thread: all inherit it
  return signals;
}

bool end_signal_within(const sigset_t& signals, Duration patience) {
  const timespec limit{0, static_cast<long>(patience.count())};
  return sigtimedwait(&signals, nullptr, &limit) > 0;
}

std::string status_line(const runtime::Pipeline& pipeline) {
  const std::uint64_t sets = pipeline.fusion_counters().sets.read();
  const std::uint64_t complete = pipeline.fusion_counters().complete_sets.read();
  return fmt::format("sets={} complete={} sent={}", sets, complete, pipeline.publish_counters().sent.read());
}

void run(runtime::Pipeline& pipeline, runtime::Service& service, const sigset_t& signals) {
  Timestamp said_at;
  Timestamp looked_at;
  while (!end_signal_within(signals, kLookAround) && !pipeline.finished()) {
    const Timestamp now = host_now();
    // Half a second between two looks, so that a thread that sleeps has gone round its loop.
    if (now - looked_at >= std::chrono::milliseconds(500)) {
      looked_at = now;
      if (pipeline.progressed()) service.alive();
    }
    if (now - said_at >= std::chrono::seconds(1)) {
      said_at = now;
      service.status(status_line(pipeline));
    }
  }
}

int serve(const settings::DaemonSettings& settings) {
  const sigset_t signals = block_end_signals();
  Result<Assembly> assembly = assemble(settings);
  if (!assembly) {
    log_error("mocapd", assembly.error().message);
    return exit_code_of(assembly.error().code);
  }
  runtime::Service service;
  if (settings.realtime.lock_memory) {
    const Status locked = runtime::lock_memory();
    if (!locked) log_warn("mocapd", locked.error().message);
  }
  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(assembly->parts));
  service.ready();
  run(pipeline, service, signals);
  service.stopping();
  pipeline.stop();
  log_info("mocapd", "ended; " + status_line(pipeline));
  return exit_code::kOk;
}

}  // namespace
}  // namespace mocap
