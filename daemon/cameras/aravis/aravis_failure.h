#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

typedef struct _GError GError;  // NOLINT(bugprone-reserved-identifier): GLib's own name, for pointers only

namespace mocap::cameras {

/// Collects the GError of one call of Aravis after the other: give it as the call's last argument, then look whether
/// it happened. One thread.
class AravisFailure {
 public:
  AravisFailure() = default;
  AravisFailure(const AravisFailure&) = delete;
  AravisFailure& operator=(const AravisFailure&) = delete;
  ~AravisFailure();

  /// Forgets the failure before.
  operator GError**();

  bool happened() const { return error_ != nullptr; }
  std::string text() const;

  /// "what: text", with the code that Aravis's own means: NotFound, Unsupported, Busy or Io.
  Error error(std::string_view what) const;

 private:
  GError* error_ = nullptr;
};

}  // namespace mocap::cameras
