#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "web/dialogue.h"
#include "web/feed/viewer.h"
#include "web/site.h"

namespace mocap::web {

inline constexpr const char* kPageSubprotocol = "mocap.v1";
inline constexpr int kMaxRequestsInWork = 8;  ///< of one page

/// The dialogue with a page of this program: topics of the feed, and requests of the control protocol.
class PageDialogue : public Dialogue {
 public:
  PageDialogue(Site& site, Hub& hub, Connection connection, Visitor visitor, std::string remote);
  ~PageDialogue() override;
  PageDialogue(const PageDialogue&) = delete;
  PageDialogue& operator=(const PageDialogue&) = delete;

  void take(const std::string& message, bool is_text) override;
  std::optional<Outgoing> next() override { return viewer_.next(); }
  void note_time(Timestamp now) override;

 private:
  void execute(SubscribeMessage&& message);
  void execute(DrawnMessage&& message);
  void execute(RequestMessage&& message);
  void say(std::string text);

  Site& site_;
  Hub& hub_;
  Connection connection_;
  Visitor visitor_;
  std::string remote_;
  Viewer viewer_;
  int in_work_ = 0;
  std::uint64_t dropped_said_ = 0;
};

}  // namespace mocap::web
