#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#include "base/expects.h"

namespace mocap {

/// A vector that lives in place and holds at most `Capacity` elements: it never allocates, and copying it costs its
/// live elements only.
///
/// Over the bound `try_push_back` returns false; the caller counts the drop.
template <class T, std::size_t Capacity>
class BoundedVector {
 public:
  using value_type = T;
  using iterator = T*;
  using const_iterator = const T*;

  BoundedVector() noexcept {}
  BoundedVector(const BoundedVector& other) { append(other); }
  BoundedVector(BoundedVector&& other) noexcept(std::is_nothrow_copy_constructible_v<T>) { append(other); }
  BoundedVector& operator=(const BoundedVector& other) {
    if (this != &other) assign(other);
    return *this;
  }
  BoundedVector& operator=(BoundedVector&& other) noexcept(std::is_nothrow_copy_constructible_v<T>) {
    if (this != &other) assign(other);
    return *this;
  }
  ~BoundedVector() { clear(); }

  static constexpr std::size_t capacity() noexcept { return Capacity; }
  std::size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }
  bool full() const noexcept { return size_ == Capacity; }

  T* data() noexcept { return std::launder(reinterpret_cast<T*>(storage_)); }
  const T* data() const noexcept { return std::launder(reinterpret_cast<const T*>(storage_)); }
  iterator begin() noexcept { return data(); }
  iterator end() noexcept { return data() + size_; }
  const_iterator begin() const noexcept { return data(); }
  const_iterator end() const noexcept { return data() + size_; }

  T& operator[](std::size_t i) {
    MOCAP_EXPECTS(i < size_);
    return data()[i];
  }
  const T& operator[](std::size_t i) const {
    MOCAP_EXPECTS(i < size_);
    return data()[i];
  }
  T& front() { return (*this)[0]; }
  const T& front() const { return (*this)[0]; }
  T& back() { return (*this)[size_ - 1]; }
  const T& back() const { return (*this)[size_ - 1]; }

  operator std::span<T>() noexcept { return {data(), size_}; }
  operator std::span<const T>() const noexcept { return {data(), size_}; }

  /// Appends if there is room. Returns whether there was.
  [[nodiscard]] bool try_push_back(const T& value) {
    if (full()) return false;
    std::construct_at(data() + size_, value);
    ++size_;
    return true;
  }

  /// Appends. Precondition: there is room.
  T& push_back(const T& value) {
    MOCAP_EXPECTS(!full());
    std::construct_at(data() + size_, value);
    return data()[size_++];
  }

  void pop_back() {
    MOCAP_EXPECTS(!empty());
    --size_;
    std::destroy_at(data() + size_);
  }

  void clear() noexcept {
    std::destroy_n(data(), size_);
    size_ = 0;
  }

  /// Grows with value-initialised elements, or shrinks.
  void resize(std::size_t count) {
    MOCAP_EXPECTS(count <= Capacity);
    while (size_ > count) pop_back();
    while (size_ < count) {
      std::construct_at(data() + size_);
      ++size_;
    }
  }

  /// Removes an element by moving the last one to its position; the order changes.
  void erase_unordered(std::size_t i) {
    MOCAP_EXPECTS(i < size_);
    if (i + 1 != size_) data()[i] = std::move(data()[size_ - 1]);
    pop_back();
  }

 private:
  void append(const BoundedVector& other) {
    for (const T& value : other) push_back(value);
  }
  void assign(const BoundedVector& other) {
    const std::size_t shared = std::min(size_, other.size_);
    std::copy_n(other.data(), shared, data());
    while (size_ > other.size_) pop_back();
    for (std::size_t i = shared; i < other.size_; ++i) push_back(other.data()[i]);
  }

  alignas(T) std::byte storage_[sizeof(T) * Capacity];
  std::size_t size_ = 0;
};

}  // namespace mocap
