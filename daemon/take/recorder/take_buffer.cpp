#include "take/recorder/take_buffer.h"

#include <algorithm>
#include <cstring>

#include "base/expects.h"

namespace mocap::take {
namespace {

constexpr std::size_t kAlign = 8;

std::size_t aligned(std::size_t size) { return (size + kAlign - 1) / kAlign * kAlign; }

}  // namespace

TakeBuffer::TakeBuffer(std::size_t capacity_bytes, Duration keep)
    : capacity_(aligned(capacity_bytes)),
      keep_(keep),
      memory_(new char[capacity_]) {}  // NOLINT(cppcoreguidelines-owning-memory): make_unique would fill all pages

TakeBuffer::Head TakeBuffer::head_at(std::uint64_t position) const {
  Head head;
  if (capacity_ - position % capacity_ < sizeof head) {
    head.skip = 1;  // no head fits before the end of the memory
  } else {
    std::memcpy(&head, memory_.get() + position % capacity_, sizeof head);
  }
  return head;
}

const char* TakeBuffer::bytes_at(std::uint64_t position) const {
  return memory_.get() + position % capacity_ + sizeof(Head);
}

std::uint64_t TakeBuffer::after(std::uint64_t position, const Head& head) const {
  if (head.skip != 0) return (position / capacity_ + 1) * capacity_;
  return position + aligned(sizeof(Head) + head.size);
}

// Removes the oldest message.
void TakeBuffer::evict() {
  const Head head = head_at(begin_);
  if (held_ && cursor_ == begin_) {
    if (head.skip == 0) ++(head.kind == BufferedKind::Blobs ? lost_.images : lost_.others);
    cursor_ = after(begin_, head);
  }
  begin_ = after(begin_, head);
}

void TakeBuffer::put(const Head& head, std::string_view bytes) {
  char* to = memory_.get() + end_ % capacity_;
  std::memcpy(to, &head, sizeof head);
  bytes.copy(to + sizeof head, bytes.size());
  end_ = after(end_, head);
}

void TakeBuffer::add(const BufferedMessage& message) {
  const std::size_t size = aligned(sizeof(Head) + message.bytes.size());
  const std::lock_guard lock(mutex_);
  const std::size_t to_wrap = capacity_ - static_cast<std::size_t>(end_ % capacity_);
  const bool wraps = to_wrap < size;
  const std::size_t needed = size + (wraps ? to_wrap : 0);
  if (needed > capacity_) {
    if (held_) ++(message.kind == BufferedKind::Blobs ? lost_.images : lost_.others);
    return;
  }
  while (room() < needed) evict();
  while (begin_ != end_ && !(held_ && cursor_ == begin_) && head_at(begin_).at < message.at - keep_) evict();
  if (wraps) {
    Head skip;
    skip.skip = 1;
    skip.at = message.at;
    if (to_wrap >= sizeof(Head)) {
      put(skip, {});
    } else {
      end_ += to_wrap;
    }
  }
  Head head;
  head.size = static_cast<std::uint32_t>(message.bytes.size());
  head.camera = message.camera;
  head.kind = message.kind;
  head.at = message.at;
  put(head, message.bytes);
}

std::optional<Timestamp> TakeBuffer::hold(Timestamp from) {
  const std::lock_guard lock(mutex_);
  std::optional<Timestamp> oldest;
  cursor_ = end_;
  lost_ = {};
  held_ = true;
  for (std::uint64_t at = begin_; at != end_;) {
    const Head head = head_at(at);
    if (head.kind == BufferedKind::Break) {
      oldest.reset();
      cursor_ = end_;
    } else if (head.skip == 0 && head.at >= from) {
      if (!oldest) cursor_ = at;
      oldest = std::min(oldest.value_or(head.at), head.at);
    }
    at = after(at, head);
  }
  return oldest;
}

void TakeBuffer::release() {
  const std::lock_guard lock(mutex_);
  held_ = false;
}

const std::vector<BufferedMessage>& TakeBuffer::next(std::size_t most_bytes) {
  batch_.clear();
  copied_.clear();
  const std::lock_guard lock(mutex_);
  if (!held_) return batch_;
  std::vector<std::size_t> begins;
  while (cursor_ != end_ && copied_.size() < most_bytes) {
    const Head head = head_at(cursor_);
    if (head.skip == 0) {
      const char* bytes = bytes_at(cursor_);
      begins.push_back(copied_.size());
      copied_.insert(copied_.end(), bytes, bytes + head.size);
      batch_.push_back({head.kind, head.camera, head.at, {bytes, head.size}});
    }
    cursor_ = after(cursor_, head);
  }
  for (std::size_t i = 0; i < batch_.size(); ++i)
    batch_[i].bytes = {copied_.data() + begins[i], batch_[i].bytes.size()};
  return batch_;
}

TakeBuffer::Lost TakeBuffer::lost() const {
  const std::lock_guard lock(mutex_);
  return lost_;
}

}  // namespace mocap::take
