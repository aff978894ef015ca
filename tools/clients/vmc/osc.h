#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::vmc {

/// Writes OSC 1.0 bundles: messages of texts, whole numbers and floats, to be done at once. A bundle ends before it
/// would pass the bytes of one UDP packet; then the next begins.
class OscBundles {
 public:
  explicit OscBundles(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void clear() { bundles_.clear(); }

  /// One message. `types` are OSC's (i, f, s) and say how many of `words`, `wholes` and `floats` it takes.
  void add(std::string_view address, std::string_view types, std::string_view word, std::vector<int> wholes,
           std::vector<float> floats);

  const std::vector<std::string>& bundles() const { return bundles_; }

 private:
  std::size_t max_bytes_;
  std::vector<std::string> bundles_;
};

}  // namespace mocap::vmc
