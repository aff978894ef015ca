#include "bench/relay/nats_subscribers.h"

#include <fmt/format.h>

#include <span>

#include "base/time.h"
#include "wire/codec/lite.h"

namespace mocap::bench {
namespace {

struct FreeOptions {
  void operator()(natsOptions* options) const { natsOptions_Destroy(options); }
};

Error failed(const std::string& url) {
  const char* text = nats_GetLastError(nullptr);
  return Error{ErrorCode::Io, fmt::format("{}: {}", url, text != nullptr ? text : "no connection")};
}

}  // namespace

Result<std::unique_ptr<NatsSubscribers>> NatsSubscribers::open(const std::string& url, const std::string& authority,
                                                               const std::string& subject, Arrivals& arrivals) {
  natsOptions* made = nullptr;
  if (natsOptions_Create(&made) != NATS_OK) return failed(url);
  const std::unique_ptr<natsOptions, FreeOptions> options(made);
  // One thread takes the messages of all connections, so that it alone writes the arrivals.
  if (natsOptions_SetURL(made, url.c_str()) != NATS_OK || nats_SetMessageDeliveryPoolSize(1) != NATS_OK ||
      natsOptions_UseGlobalMessageDelivery(made, true) != NATS_OK) {
    return failed(url);
  }
  if (!authority.empty() && (natsOptions_SetSecure(made, true) != NATS_OK ||
                             natsOptions_LoadCATrustedCertificates(made, authority.c_str()) != NATS_OK)) {
    return failed(authority);
  }
  std::unique_ptr<NatsSubscribers> all(new NatsSubscribers(arrivals));
  for (std::size_t i = 0; i < all->each_.size(); ++i) {
    One& one = all->each_[i];
    one.all = all.get();
    one.index = i;
    if (natsConnection_Connect(&one.connection, made) != NATS_OK ||
        natsConnection_Subscribe(&one.subscription, one.connection, subject.c_str(), take, &one) != NATS_OK ||
        natsConnection_Flush(one.connection) != NATS_OK) {
      return failed(url);
    }
  }
  return all;
}

NatsSubscribers::~NatsSubscribers() {
  for (const One& one : each_) {
    natsSubscription_Destroy(one.subscription);
    natsConnection_Destroy(one.connection);
  }
  // Waits for the threads of the library, which may still call take().
  if (each_.back().connection != nullptr) nats_Close();
}

void NatsSubscribers::take(natsConnection* /*connection*/, natsSubscription* /*subscription*/, natsMsg* message,
                           void* of) {
  One& one = *static_cast<One*>(of);
  const std::int64_t now_ns = to_ns(host_now());
  wire::Lite lite;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(natsMsg_GetData(message));
  if (wire::decode_lite({bytes, static_cast<std::size_t>(natsMsg_GetDataLength(message))}, lite)) {
    one.all->arrivals_.note(one.index, lite.number, now_ns);
    if (!one.joined) ++one.all->joined_;
    one.joined = true;
  }
  natsMsg_Destroy(message);
}

}  // namespace mocap::bench
