#pragma once

#include <chrono>
#include <functional>
#include <string_view>
#include <utility>

#include "base/time.h"

namespace mocap::watch {

/// Writes lines for a reader that may be slow. A signal that asks the program to stop neither cuts a line nor waits for
/// a reader that reads no more.
class LineWriter {
 public:
  /// Time that the reader has for the rest of a line after a stop was asked.
  static constexpr Duration kRestOfLine = std::chrono::seconds(1);

  /// `stop_asked` is called by the thread that calls write().
  LineWriter(int descriptor, std::function<bool()> stop_asked)
      : descriptor_(descriptor), stop_asked_(std::move(stop_asked)) {}

  /// Writes a line, which ends with '\n', and waits for the reader. Returns false if the reader has closed the
  /// descriptor or has not taken the whole line kRestOfLine after a stop was asked.
  bool write(std::string_view line) const;

 private:
  int descriptor_;
  std::function<bool()> stop_asked_;
};

}  // namespace mocap::watch
