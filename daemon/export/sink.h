#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "base/result.h"

namespace mocap::exports {

/// Receives the bytes of a file, piece by piece, in order. An error ends the export.
using Sink = std::function<Status(std::string_view bytes)>;

/// Collects small pieces for a Sink.
class BufferedSink {
 public:
  explicit BufferedSink(const Sink& sink) : sink_(sink) {}

  /// The text that is not passed on yet: append to it, then call `pass_on`.
  std::string& text() noexcept { return text_; }

  /// Passes the text on if it is longer than 64 KiB.
  Status pass_on() { return text_.size() < kPiece_bytes ? Status{} : finish(); }

  /// Passes the rest on.
  Status finish() {
    Status passed = text_.empty() ? Status{} : sink_(text_);
    text_.clear();
    return passed;
  }

 private:
  static constexpr std::size_t kPiece_bytes = 64 * 1024;

  const Sink& sink_;
  std::string text_;
};

}  // namespace mocap::exports
