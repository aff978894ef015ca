// The C ABI: opaque handles, one thread for each client, no exceptions across the boundary.
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <new>
#include <thread>

#include "clock.h"
#include "mocap_client.h"
#include "socket.h"
#include "text.h"

using mocap::client::Axes;
using mocap::client::copy_text;
using mocap::client::Feed;
using mocap::client::FeedSettings;
using mocap::client::fill;
using mocap::client::Frame;
using mocap::client::read_keys;
using mocap::client::Socket;
using mocap::client::SocketSettings;
using mocap::client::text_of;

struct mocap_client {
  std::mutex mutex;  // guards feed
  std::condition_variable frame_received;
  Feed feed;
  std::unique_ptr<Socket> socket;
  void (*on_message)(void*);  // NULL: none
  void* on_message_argument;
  std::thread thread;

  mocap_client(const FeedSettings& settings, std::unique_ptr<Socket> opened, const mocap_client_options& options)
      : feed(settings),
        socket(std::move(opened)),
        on_message(options.on_message),
        on_message_argument(options.on_message_argument),
        thread([this] { run(); }) {}
  mocap_client(const mocap_client&) = delete;
  mocap_client& operator=(const mocap_client&) = delete;
  ~mocap_client() {
    socket->interrupt();
    thread.join();
  }

  void run() {
    constexpr int kPatience_ms = 100;
    bool on = true;
    while (on) {
      bool any = false;
      try {
        on = socket->receive(kPatience_ms, [&](std::string_view message) {
          const std::lock_guard<std::mutex> lock(mutex);
          feed.take(message, mocap::client::now());
          any = true;
        });
        const std::lock_guard<std::mutex> lock(mutex);
        feed.note(socket->link());
      } catch (const std::exception&) {
        // Out of memory: drop this message and continue.
      }
      if (!any) continue;
      frame_received.notify_all();
      if (on_message != nullptr) on_message(on_message_argument);
    }
  }
};

namespace {

constexpr int32_t kNull = -1;
constexpr int32_t kNoMemory = -2;
constexpr int32_t kMaxKept = 100000;
std::atomic<std::uint64_t> next_id{1};

std::string fault_of(const mocap_client_options& options) {
  if (!Axes::known(options.axes))
    return "axes is " + std::to_string(options.axes) + ", expected 0 to 4 (enum mocap_axes)";
  if (options.keep < 1 || options.keep > kMaxKept) {
    return "keep is " + std::to_string(options.keep) + ", expected 1 to " + std::to_string(kMaxKept);
  }
  if (options.topic == nullptr || *options.topic == '\0')
    return "topic is empty, expected \"snapshot\" or another topic of the feed";
  return {};
}

mocap_client* open_client(const mocap_client_options& options, std::string& fault) {
  fault = fault_of(options);
  if (!fault.empty()) return nullptr;
  SocketSettings socket_settings{
      text_of(options.endpoint),
      text_of(options.topic),
      {text_of(options.server_key), text_of(options.public_key), text_of(options.secret_key)}};
  fault = read_keys(socket_settings.keys);
  if (!fault.empty()) return nullptr;
  std::unique_ptr<Socket> socket = Socket::open(socket_settings, fault);
  if (socket == nullptr) return nullptr;
  return new mocap_client({socket_settings.endpoint, socket_settings.topic, options.axes,
                           static_cast<std::size_t>(options.keep), next_id++},
                          std::move(socket), options);
}

int32_t hand_out(mocap_client& client, Frame& into) {
  try {
    return client.feed.hand_out(into, mocap::client::now()) ? 1 : 0;
  } catch (const std::exception&) {
    return kNoMemory;
  }
}

}  // namespace

extern "C" {

int32_t mocap_client_abi(void) { return MOCAP_CLIENT_ABI; }

void mocap_client_options_init(mocap_client_options* options, size_t size) {
  if (options == nullptr) return;
  mocap_client_options defaults{};
  defaults.size = size;
  defaults.endpoint = "tcp://127.0.0.1:5570";
  defaults.topic = "snapshot";
  defaults.axes = MOCAP_AXES_MOCAP;
  defaults.keep = 1;
  std::memset(options, 0, size);
  fill(options, size, defaults);
}

mocap_client* mocap_client_open(const mocap_client_options* options, char* fault, size_t fault_size) {
  try {
    mocap_client_options all;
    mocap_client_options_init(&all, sizeof(all));
    if (options != nullptr) fill(&all, options->size, *options);
    std::string why;
    mocap_client* client = open_client(all, why);
    if (client == nullptr) copy_text(fault, fault_size, why);
    return client;
  } catch (const std::exception& exception) {
    copy_text(fault, fault_size, exception.what());
    return nullptr;
  }
}

void mocap_client_close(mocap_client* client) { delete client; }

mocap_frame* mocap_frame_new(void) { return new (std::nothrow) mocap_frame; }
void mocap_frame_free(mocap_frame* frame) { delete frame; }

int32_t mocap_client_poll(mocap_client* client, mocap_frame* frame) {
  if (client == nullptr || frame == nullptr) return kNull;
  const std::lock_guard<std::mutex> lock(client->mutex);
  return hand_out(*client, frame->frame);
}

int32_t mocap_client_wait(mocap_client* client, mocap_frame* frame, int32_t timeout_ms) {
  if (client == nullptr || frame == nullptr) return kNull;
  std::unique_lock<std::mutex> lock(client->mutex);
  int32_t got = 0;
  client->frame_received.wait_for(lock, std::chrono::milliseconds(std::max(timeout_ms, 0)),
                                  [&] { return (got = hand_out(*client, frame->frame)) != 0; });
  return got;
}

int32_t mocap_client_get_statistics(mocap_client* client, mocap_statistics* into, size_t size) {
  if (client == nullptr || into == nullptr) return kNull;
  const std::lock_guard<std::mutex> lock(client->mutex);
  fill(into, size, client->feed.statistics(mocap::client::now()));
  return 0;
}

int32_t mocap_client_diagnose(mocap_client* client, char* sentence, size_t sentence_size) {
  if (client == nullptr) return kNull;
  try {
    const std::lock_guard<std::mutex> lock(client->mutex);
    const mocap::client::Diagnosis diagnosis = client->feed.diagnose(mocap::client::now());
    copy_text(sentence, sentence_size, diagnosis.sentence);
    return diagnosis.code;
  } catch (const std::exception&) {
    return kNoMemory;
  }
}

int32_t mocap_client_get_health(mocap_client* client, mocap_health* into) {
  if (client == nullptr || into == nullptr) return kNull;
  const std::lock_guard<std::mutex> lock(client->mutex);
  into->health = client->feed.health();
  return into->health == nullptr ? 0 : 1;
}

int32_t mocap_client_next_event(mocap_client* client, mocap_event* into, size_t size) {
  if (client == nullptr || into == nullptr) return kNull;
  const std::lock_guard<std::mutex> lock(client->mutex);
  mocap_event event;
  if (!client->feed.next_event(event)) return 0;
  fill(into, size, event);
  return 1;
}

}  // extern "C"
