#include "bridges/lib/feed_source.h"

#include <sys/eventfd.h>

#include <chrono>
#include <utility>

namespace mocap::bridge {
namespace {

constexpr int kPatience_ms = 100;  // longest time until the thread sees that it is to end

}  // namespace

std::int64_t monotonic_ns() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::unique_ptr<FeedSource> FeedSource::open(const ClientOptions& options, std::string& fault) {
  Descriptor wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!wake) {
    fault = "no eventfd: too many open files";
    return nullptr;
  }
  auto client = Client::open(options, &fault);
  if (!client) return nullptr;
  return std::unique_ptr<FeedSource>(new FeedSource(std::move(*client), std::move(wake)));
}

FeedSource::FeedSource(Client client, Descriptor wake)
    : client_(std::move(client)), wake_(std::move(wake)), thread_([this] { wait_for_frames(); }) {}

FeedSource::~FeedSource() {
  running_ = false;
  thread_.join();
}

void FeedSource::wait_for_frames() {
  ClientFrame frame;  // of this thread: the loop's frame gets every frame too
  while (running_) {
    if (!client_.wait(frame, kPatience_ms)) continue;
    arrived_ns_ = monotonic_ns();
    ::eventfd_write(wake_.number(), 1);
  }
}

void FeedSource::acknowledge() {
  eventfd_t count = 0;
  ::eventfd_read(wake_.number(), &count);
}

}  // namespace mocap::bridge
