#include "bridges/lib/feed_source.h"

#include <sys/eventfd.h>

#include <chrono>
#include <utility>

namespace mocap::bridge {

std::int64_t monotonic_ns() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::unique_ptr<FeedSource> FeedSource::open(ClientOptions options, std::string& fault) {
  Descriptor wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!wake) {
    fault = "no eventfd: too many open files";
    return nullptr;
  }
  std::unique_ptr<FeedSource> source(new FeedSource(std::move(wake)));
  options.on_message = [](void* of) { static_cast<FeedSource*>(of)->note_message(); };
  options.on_message_argument = source.get();
  source->client_ = Client::open(options, &fault);
  return source->client_ ? std::move(source) : nullptr;
}

void FeedSource::note_message() {
  arrived_ns_ = monotonic_ns();
  ::eventfd_write(wake_.number(), 1);
}

void FeedSource::acknowledge() {
  eventfd_t count = 0;
  ::eventfd_read(wake_.number(), &count);
}

}  // namespace mocap::bridge
