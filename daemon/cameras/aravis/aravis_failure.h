#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

typedef struct _GError GError;  // NOLINT(bugprone-reserved-identifier): GLib's own name, for pointers only

namespace mocap::cameras {

/// Holds the GError of the last Aravis call. Pass the object as the last argument of each call, then test happened().
/// One thread.
class AravisFailure {
 public:
  AravisFailure() = default;
  AravisFailure(const AravisFailure&) = delete;
  AravisFailure& operator=(const AravisFailure&) = delete;
  ~AravisFailure();

  /// Clears the previous error.
  operator GError**();

  bool happened() const { return error_ != nullptr; }
  std::string text() const;

  /// The message "what: text" with the code that corresponds to the error code of Aravis: NotFound, Unsupported, Busy
  /// or Io.
  Error error(std::string_view what) const;

 private:
  GError* error_ = nullptr;
};

}  // namespace mocap::cameras
