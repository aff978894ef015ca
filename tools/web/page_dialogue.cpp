#include "web/page_dialogue.h"

#include <fmt/format.h>

#include <utility>
#include <variant>

namespace mocap::web {

PageDialogue::PageDialogue(Site& site, Hub& hub, Connection connection, Visitor visitor, std::string remote)
    : site_(site),
      hub_(hub),
      connection_(std::move(connection)),
      visitor_(std::move(visitor)),
      remote_(std::move(remote)),
      viewer_(connection_.wake) {
  hub_.join(viewer_);
}

PageDialogue::~PageDialogue() {
  hub_.leave(viewer_);
  connection_.topics_changed();
}

void PageDialogue::take(const std::string& message, bool is_text) {
  Result<PageMessage> read = Error{ErrorCode::InvalidArgument, "expected text, this message is binary"};
  if (is_text) read = read_page_message(message);
  if (read) return std::visit([this](auto&& each) { execute(std::move(each)); }, *std::move(read));
  connection_.note_refused("message");
  say(error_text(0, "CODE_INVALID", read.error().message));
}

void PageDialogue::execute(SubscribeMessage&& message) {
  hub_.subscribe(viewer_, std::move(message.topics));
  connection_.topics_changed();
}

void PageDialogue::execute(DrawnMessage&& /*message*/) { viewer_.note_drawn(); }

void PageDialogue::execute(RequestMessage&& message) {
  if (in_work_ == kMaxRequestsInWork) {
    return say(error_text(message.id, "CODE_FAILED", "eight requests of this page wait for their answer"));
  }
  ++in_work_;
  site_.answer(message, visitor_, remote_, [this, held = connection_.hold()](std::string text) {
    --in_work_;
    say(std::move(text));
  });
}

void PageDialogue::note_time(Timestamp now) {
  viewer_.say_state(site_.state_text(visitor_, now));
  if (const auto dropped = viewer_.dropped_snapshots(); dropped != dropped_said_) {
    dropped_said_ = dropped;
    say(fmt::format(R"({{"dropped":{{"snapshot":{}}}}})", dropped));
  }
}

void PageDialogue::say(std::string text) {
  if (!viewer_.say(std::move(text))) connection_.cut("slow");
}

}  // namespace mocap::web
