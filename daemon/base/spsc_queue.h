#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <new>
#include <vector>

#include "base/expects.h"

namespace mocap {

/// A bounded lock-free queue for exactly one producer thread and one consumer thread.
///
/// The slots are built once and live as long as the queue; an item is copied into its slot and, by `try_pop`, out of
/// it. `front` and `pop` let the consumer work on the item in its slot. Neither side allocates or waits, as long as
/// copying a T does not.
///
/// Source: Lamport, "Specifying concurrent program modules" (1983); with the cached indices of Lee et al., "A
/// lock-free, cache-efficient multi-core synchronization mechanism" (2009).
template <class T>
class SpscQueue {
 public:
  /// At most `capacity` items wait at a time; at least 1.
  explicit SpscQueue(std::size_t capacity)
      : slots_(std::bit_ceil(capacity)), mask_(slots_.size() - 1), capacity_(capacity) {
    MOCAP_EXPECTS(capacity > 0);
  }
  SpscQueue(const SpscQueue&) = delete;
  SpscQueue& operator=(const SpscQueue&) = delete;

  std::size_t capacity() const noexcept { return capacity_; }

  /// Producer. Returns false if the queue is full; the producer counts the drop.
  [[nodiscard]] bool try_push(const T& item) {
    T* const slot = vacant();
    if (slot == nullptr) return false;
    *slot = item;
    push();
    return true;
  }

  /// Producer. A free slot, to be filled in place; null when the queue is full. `push` then adds it to the queue.
  [[nodiscard]] T* vacant() noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_seen_ >= capacity_) {
      head_seen_ = head_.load(std::memory_order_acquire);
      if (tail - head_seen_ >= capacity_) return nullptr;
    }
    return &slots_[tail & mask_];
  }

  /// Producer. Adds the slot of `vacant`.
  void push() noexcept { tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  /// Consumer. The oldest item, in place until `pop`; null when the queue is empty.
  [[nodiscard]] T* front() noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_seen_) {
      tail_seen_ = tail_.load(std::memory_order_acquire);
      if (head == tail_seen_) return nullptr;
    }
    return &slots_[head & mask_];
  }

  /// Consumer. Releases the slot of `front`.
  void pop() noexcept { head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  /// Consumer. Returns false if the queue is empty.
  [[nodiscard]] bool try_pop(T& item) {
    T* oldest = front();
    if (oldest == nullptr) return false;
    item = *oldest;
    pop();
    return true;
  }

  /// Number of waiting items; approximate while the other side works.
  std::size_t size() const noexcept {
    const std::size_t head = head_.load(std::memory_order_acquire);
    return tail_.load(std::memory_order_acquire) - head;
  }

 private:
  static constexpr std::size_t kCacheLine = 64;

  std::vector<T> slots_;
  std::size_t mask_;
  std::size_t capacity_;
  alignas(kCacheLine) std::atomic<std::size_t> head_{0};
  std::size_t tail_seen_ = 0;  // the consumer's cached copy of tail_
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};
  std::size_t head_seen_ = 0;  // the producer's cached copy of head_
};

}  // namespace mocap
