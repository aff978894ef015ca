#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/bounded_vector.h"

namespace mocap {

class Archive;

/// A class that names its members to an archive: `void archive(Archive& members) { members(one_, other_); }`.
template <class T>
concept Archivable = requires(T& object, Archive& members) {
  object.archive(members);
};

/// Writes the members of objects to bytes, or sets them from bytes, by one list of members for both directions.
///
/// The bytes have no types and no names: only the same version of the program on the same kind of processor reads them.
/// A reader sets objects that were built with the same settings, and checks sizes: a vector that has elements keeps
/// their number, an empty one gets at most as many as its capacity. After the first mismatch `ok` is false and no
/// member is set. Never allocates, as long as the members have their capacity, and never throws.
class Archive {
 public:
  static Archive writer(std::span<std::byte> into) { return {into, {}, false}; }
  static Archive reader(std::span<const std::byte> from) { return {{}, from, true}; }

  bool is_reading() const noexcept { return is_reading_; }
  /// False if there was no room for the members, or the bytes are not those of such members.
  bool ok() const noexcept { return ok_; }
  void fail() noexcept { ok_ = false; }
  /// Bytes written or read so far.
  std::size_t size() const noexcept { return at_; }

  template <class... Members>
  void operator()(Members&... members) {
    (one(members), ...);
  }

  /// The number of elements of a container that the caller resizes: written, or read, at most `most`.
  std::size_t count(std::size_t now, std::size_t most) {
    auto number = static_cast<std::uint32_t>(now);
    bytes(&number, sizeof(number));
    if (number > most) fail();
    return ok_ ? number : now;
  }

 private:
  Archive(std::span<std::byte> into, std::span<const std::byte> from, bool is_reading)
      : into_(into), from_(from), is_reading_(is_reading) {}

  /// Types whose bytes are their value.
  template <class T>
  static constexpr bool kIsPlain = !Archivable<T> && !std::same_as<T, bool> && !std::is_pointer_v<T> &&
                                   (std::is_floating_point_v<T> || std::has_unique_object_representations_v<T>);

  template <class T>
  void one(T& member) {
    if constexpr (Archivable<T>) {
      member.archive(*this);
    } else if constexpr (std::same_as<T, bool>) {
      flag(member);
    } else if constexpr (kIsPlain<T>) {
      static_assert(std::is_trivially_copyable_v<T>);
      bytes(&member, sizeof(T));
    } else if constexpr (requires { member.coeffs().data(); }) {  // a quaternion
      one(member.coeffs());
    } else if constexpr (requires { T::SizeAtCompileTime; }) {  // a matrix of Eigen
      if (count(static_cast<std::size_t>(member.size()), static_cast<std::size_t>(member.size())) !=
          static_cast<std::size_t>(member.size())) {
        return fail();
      }
      bytes(member.data(), static_cast<std::size_t>(member.size()) * sizeof(*member.data()));
    } else {
      container(member);
    }
  }

  template <class T, std::size_t N>
  void container(std::array<T, N>& elements) {
    all(std::span<T>(elements));
  }
  template <class T, std::size_t N>
  void container(BoundedVector<T, N>& elements) {
    const std::size_t size = count(elements.size(), N);
    if (is_reading_ && ok_) elements.resize(size);
    all(std::span<T>(elements));
  }
  template <class T>
  void container(std::vector<T>& elements) {
    resize(elements);
    all(std::span<T>(elements));
  }
  void container(std::vector<bool>& elements) {
    resize(elements);
    for (auto&& element : elements) {
      bool value = element;
      flag(value);
      element = value;
    }
  }
  template <class T>
  void container(std::optional<T>& maybe) {
    bool there = maybe.has_value();
    flag(there);
    if (!there) return maybe.reset();
    if (!maybe) maybe.emplace();
    one(*maybe);
  }
  template <class A, class B>
  void container(std::pair<A, B>& both) {
    one(both.first);
    one(both.second);
  }

  template <class T>
  void all(std::span<T> elements) {
    if constexpr (kIsPlain<T>) {
      if (!elements.empty()) bytes(elements.data(), elements.size_bytes());
    } else {
      for (T& element : elements) one(element);
    }
  }

  template <class T>
  void resize(std::vector<T>& elements) {
    const std::size_t size = count(elements.size(), elements.capacity());
    if (!elements.empty() && size != elements.size()) return fail();
    if (is_reading_ && ok_) elements.resize(size);
  }

  void flag(bool& value) {
    auto byte = static_cast<std::uint8_t>(value);
    bytes(&byte, 1);
    if (byte > 1) return fail();
    if (ok_) value = byte != 0;
  }

  void bytes(void* member, std::size_t size) {
    const std::size_t end = is_reading_ ? from_.size() : into_.size();
    if (!ok_ || size > end - at_) return fail();
    if (is_reading_) {
      std::memcpy(member, from_.data() + at_, size);
    } else {
      std::memcpy(into_.data() + at_, member, size);
    }
    at_ += size;
  }

  std::span<std::byte> into_;
  std::span<const std::byte> from_;
  std::size_t at_ = 0;
  bool is_reading_;
  bool ok_ = true;
};

}  // namespace mocap
