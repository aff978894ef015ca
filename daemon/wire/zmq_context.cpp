#include "wire/zmq_context.h"

#include <pthread.h>
#include <sys/epoll.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <string_view>

namespace mocap::wire {
namespace {

constexpr std::uint32_t kHangUp = EPOLLERR | EPOLLHUP;
constexpr timespec kUntilNextLook{0, 1'000'000};

bool is_thread_of_zmq() {
  char name[16] = {};  // the longest name of a thread on Linux
  return pthread_getname_np(pthread_self(), name, sizeof(name)) == 0 && std::string_view(name).starts_with("ZMQbg");
}

// Removes hang-ups from events. An event of a connection that is read or written stays: the read or the write fails, so
// that ZeroMQ learns of the end. Returns the number of the events that stay.
int without_hang_ups(epoll_event* events, int count) {
  epoll_event* const end = std::remove_if(events, events + count, [](epoll_event& event) {
    event.events &= ~kHangUp;
    return event.events == 0;
  });
  return static_cast<int>(end - events);
}

}  // namespace

ZmqContext::ZmqContext() : context_(zmq_ctx_new()) {}

ZmqContext::~ZmqContext() {
  if (context_ != nullptr) zmq_ctx_term(context_);
}

}  // namespace mocap::wire

// Takes the place of the C library's function in this program, for the threads of libzmq (decisions/0009). The kernel
// reports hang-ups also for a connection that ZeroMQ does not read because its queue is full, and libzmq aborts when
// it uses such a connection later.
extern "C" __attribute__((visibility("default"))) int epoll_wait(int epoll, epoll_event* events, int most,
                                                                 int timeout_ms) {
  thread_local const bool of_zmq = mocap::wire::is_thread_of_zmq();
  const auto count = static_cast<int>(::syscall(SYS_epoll_pwait, epoll, events, most, timeout_ms, nullptr, 0));
  if (!of_zmq || count <= 0) return count;
  const int left = mocap::wire::without_hang_ups(events, count);
  if (left == 0) ::nanosleep(&mocap::wire::kUntilNextLook, nullptr);  // the kernel reports the same hang-up at once
  return left;
}
