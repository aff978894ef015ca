#pragma once

#include <cstddef>
#include <vector>

#include "base/archive.h"

namespace mocap::test {

/// The belief of an object as bytes; empty if it did not fit into 16 MB.
template <class T>
std::vector<std::byte> archived(T& object) {
  std::vector<std::byte> bytes(std::size_t{16} << 20U);
  Archive members = Archive::writer(bytes);
  object.archive(members);
  bytes.resize(members.ok() ? members.size() : 0);
  return bytes;
}

/// Reads the belief into an object. Returns whether the object took over exactly these bytes.
template <class T>
bool take_over(const std::vector<std::byte>& bytes, T& into) {
  Archive members = Archive::reader(bytes);
  into.archive(members);
  return members.ok() && !bytes.empty() && members.size() == bytes.size();
}

}  // namespace mocap::test
