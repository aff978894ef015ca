#pragma once

namespace mocap::sim {

/// While cameras stream, this program's g_poll never sleeps longer than 1 ms where 100 ms are asked for.
///
/// Aravis 0.8.26 computes a fake camera's wait for the next frame in unsigned arithmetic: just past due it becomes
/// huge and is cut to 100 ms, about once a second and camera. This program's own g_poll stands before GLib's.
void poll_for_streams(bool streaming) noexcept;

}  // namespace mocap::sim
