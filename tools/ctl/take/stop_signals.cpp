#include "ctl/take/stop_signals.h"

#include <array>
#include <csignal>

namespace mocap::ctl {
namespace {

constexpr std::array<int, 2> kSignals{SIGINT, SIGTERM};

// A signal handler has no other place to write to.
volatile std::sig_atomic_t g_count = 0;
volatile std::sig_atomic_t g_last = 0;

void count_signal(int signal);

void handle(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;  // without SA_RESTART: poll returns
  for (const int signal : kSignals) ::sigaction(signal, &action, nullptr);
}

void count_signal(int signal) {
  g_last = signal;
  g_count = g_count + 1;
  if (g_count <= StopSignals::kMost) return;
  handle(SIG_DFL);
  (void)::raise(signal);  // delivered when this handler returns
}

}  // namespace

StopSignals::StopSignals() {
  g_count = 0;
  handle(count_signal);
}

StopSignals::~StopSignals() { handle(SIG_DFL); }

int StopSignals::count() const noexcept { return static_cast<int>(g_count); }

void StopSignals::end_program() const {
  if (g_count == 0) return;
  handle(SIG_DFL);
  (void)::raise(static_cast<int>(g_last));
}

}  // namespace mocap::ctl
