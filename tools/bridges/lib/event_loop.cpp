#include "bridges/lib/event_loop.h"

#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <utility>

namespace mocap::bridge {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kEventsATime = 64;

sigset_t end_signals() {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  return ends;
}

Descriptor open_signals() {
  block_end_signals();
  const sigset_t ends = end_signals();
  return Descriptor(::signalfd(-1, &ends, SFD_CLOEXEC | SFD_NONBLOCK));
}

}  // namespace

void block_end_signals() {
  const sigset_t ends = end_signals();
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
}

void unblock_end_signals() {
  const sigset_t ends = end_signals();
  pthread_sigmask(SIG_UNBLOCK, &ends, nullptr);
}

EventLoop::EventLoop() : epoll_(::epoll_create1(EPOLL_CLOEXEC)), signals_(open_signals()) {
  watch(signals_.number(), EPOLLIN, [this](std::uint32_t /*events*/) {
    // The signal is taken: unblock_end_signals() must find only a second one.
    signalfd_siginfo signal{};
    if (::read(signals_.number(), &signal, sizeof signal) == sizeof signal) stop();
  });
}

EventLoop::~EventLoop() = default;

void EventLoop::watch(int descriptor, std::uint32_t events, Ready ready) {
  ready_[descriptor] = std::make_shared<Ready>(std::move(ready));
  epoll_event event{};
  event.events = events;
  event.data.fd = descriptor;
  ::epoll_ctl(epoll_.number(), EPOLL_CTL_ADD, descriptor, &event);
}

void EventLoop::change(int descriptor, std::uint32_t events) {
  epoll_event event{};
  event.events = events;
  event.data.fd = descriptor;
  ::epoll_ctl(epoll_.number(), EPOLL_CTL_MOD, descriptor, &event);
}

void EventLoop::forget(int descriptor) {
  ::epoll_ctl(epoll_.number(), EPOLL_CTL_DEL, descriptor, nullptr);
  ready_.erase(descriptor);
}

void EventLoop::dispatch(int timeout_ms) {
  std::array<epoll_event, kEventsATime> events;
  const int count = ::epoll_wait(epoll_.number(), events.data(), kEventsATime, timeout_ms);
  for (int i = 0; i < count; ++i) {
    const epoll_event& event = events[static_cast<std::size_t>(i)];
    const auto found = ready_.find(event.data.fd);
    if (found == ready_.end()) continue;                 // forgotten by an earlier event of this round
    const std::shared_ptr<Ready> ready = found->second;  // lives on if it forgets itself
    (*ready)(event.events);
  }
}

void EventLoop::run(std::chrono::milliseconds period, const std::function<void()>& tick) {
  running_ = true;
  auto next = Clock::now();
  while (running_) {
    if (Clock::now() >= next) {
      tick();
      next = std::max(next + period, Clock::now());
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(next - Clock::now());
    dispatch(static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
  }
}

}  // namespace mocap::bridge
