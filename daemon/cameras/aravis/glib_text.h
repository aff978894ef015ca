#pragma once

#include <string>

namespace mocap::cameras {

/// A text of GLib; empty for a null pointer.
inline std::string text_of(const char* text) { return text != nullptr ? text : ""; }

}  // namespace mocap::cameras
