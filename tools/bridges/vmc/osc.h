#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::vmc {

/// Writes OSC 1.0 bundles of messages with strings, integers and floats, for immediate execution. Starts a new bundle
/// before the current bundle exceeds the size of one UDP packet.
class OscBundles {
 public:
  explicit OscBundles(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void clear() { bundles_.clear(); }

  /// Adds one message. `types` are OSC type tags (i, f, s); they determine how many values of `word`, `wholes` and
  /// `floats` the message contains.
  void add(std::string_view address, std::string_view types, std::string_view word, std::vector<int> wholes,
           std::vector<float> floats);

  const std::vector<std::string>& bundles() const { return bundles_; }

 private:
  std::size_t max_bytes_;
  std::vector<std::string> bundles_;
};

}  // namespace mocap::vmc
