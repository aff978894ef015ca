#include "runtime/trigger_worker.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "base/log.h"
#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {

constexpr const char* kTrigger = "trigger";

std::string text_of(const Peer& peer) {
  const std::uint32_t address = peer.address;
  return fmt::format("{}.{}.{}.{}:{}", address >> 24U, (address >> 16U) & 255U, (address >> 8U) & 255U, address & 255U,
                     peer.port);
}

void write(const TriggerActions::Line& line) {
  line.refused ? log_warn(kTrigger, line.text) : log_info(kTrigger, line.text);
}

}  // namespace

TriggerWorker::TriggerWorker(TriggerParts parts, TakeChannel& takes) : parts_(std::move(parts)), takes_(takes) {}

void TriggerWorker::run(const std::stop_token& stop) {
  for (;;) {
    takes_.news_came.clear();
    const bool ended = stop.stop_requested();
    hear_news();
    if (ended) return;
    if (const auto datagram = parts_.port->next(takes_.news_came.number(), kStopCheckPeriod)) {
      const Timestamp came_at = host_now();
      TriggerActions actions = parts_.desk->receive(*datagram, came_at);
      if (actions.order) actions.order->by = {.name = "trigger", .address = text_of(datagram->peer)};
      if (actions.order) actions.order->at = came_at;
      execute(std::move(actions));
    }
  }
}

void TriggerWorker::hear_news() {
  while (const TakeNews* oldest = takes_.news.front()) {
    const TakeNews news = *oldest;
    takes_.news.pop();
    execute(parts_.desk->hear(news, host_now()));
  }
}

void TriggerWorker::execute(TriggerActions actions) {
  for (const Datagram& packet : actions.packets) parts_.port->send(packet);
  for (const TriggerActions::Line& line : actions.lines) write(line);
  if (!actions.order || pass(*actions.order)) return;
  const TakeDone busy{actions.order->number, TakeOutcome::Failed, "the recorder is busy with other orders"};
  execute(parts_.desk->hear({busy.order, busy, std::nullopt}, host_now()));
}

bool TriggerWorker::pass(const TakeOrder& order) {
  if (!takes_.trigger_orders.try_push(order)) return false;
  takes_.ordered.signal();
  return true;
}

}  // namespace mocap::runtime
