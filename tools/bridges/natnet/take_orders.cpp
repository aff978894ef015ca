#include "bridges/natnet/take_orders.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "bridges/lib/bridge.h"

namespace mocap::natnet {
namespace {

constexpr std::int32_t kPatience_ms = 30'000;  // a take ends when the disk has all of it
constexpr std::int32_t kFarewell_ms = 2'000;   // while the program ends; the daemon ends the take all the same

}  // namespace

std::unique_ptr<TakeOrders> TakeOrders::open(const std::string& endpoint, const cli::KeyOptions& keys,
                                             std::string& fault) {
  mocap_control_options options;
  mocap_control_options_init(&options, sizeof options);
  options.endpoint = endpoint.c_str();
  if (!keys.server_key.empty()) options.server_key = keys.server_key.c_str();
  if (!keys.secret_key.empty()) options.secret_key = keys.secret_key.c_str();
  std::array<char, 512> why{};
  mocap_control* const control = mocap_control_open(&options, why.data(), why.size());
  if (control != nullptr) return std::unique_ptr<TakeOrders>(new TakeOrders(control));
  fault = why.data();
  return nullptr;
}

TakeOrders::TakeOrders(mocap_control* control)
    : control_(control), answer_(mocap_answer_new()), thread_([this] { run(); }) {}

TakeOrders::~TakeOrders() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    std::erase_if(waiting_, [](const Record& one) { return one.start; });
    waiting_.resize(std::min<std::size_t>(waiting_.size(), 1));
    if (asking_ || !waiting_.empty()) {
      bridge::say("mocap-natnet", "waits for the daemon's answer about a take; Ctrl-C ends the program at once");
    }
  }
  changed_.notify_all();
  thread_.join();
  mocap_answer_free(answer_);
  mocap_control_close(control_);
}

bool TakeOrders::order(const Record& wanted) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMaxWaiting) return false;
    waiting_.push_back(wanted);
  }
  changed_.notify_all();
  return true;
}

void TakeOrders::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const Record next = std::move(waiting_.front());
    waiting_.pop_front();
    const std::int32_t patience_ms = stopping_ ? kFarewell_ms : kPatience_ms;
    asking_ = true;
    lock.unlock();
    send(next, patience_ms);
    lock.lock();
    asking_ = false;
  }
}

void TakeOrders::send(const Record& wanted, std::int32_t patience_ms) {
  mocap_request request;
  mocap_request_init(&request, sizeof request, wanted.start ? MOCAP_REQUEST_TAKE_START : MOCAP_REQUEST_TAKE_STOP);
  request.timeout_ms = patience_ms;
  if (wanted.start && !wanted.name.empty()) request.name = wanted.name.c_str();
  const bool done = mocap_control_ask(control_, &request, answer_) == MOCAP_CODE_DONE;
  bridge::say("mocap-natnet",
              fmt::format("{}{}", done ? "" : "a client's order was refused: ", mocap_answer_message(answer_)));
}

}  // namespace mocap::natnet
