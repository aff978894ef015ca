#include "calibrate/run_cameras.h"

#include <fmt/format.h>

#include <thread>
#include <utility>

#include "assemble_camera.h"
#include "cameras/replay/replay_settings.h"

namespace mocap::calibrate {
namespace {

constexpr Duration kPatience = std::chrono::milliseconds(50);
constexpr Duration kWatchEvery = std::chrono::milliseconds(100);
// Discovery and the start of a camera take seconds.
constexpr Duration kFirstImageWithin = std::chrono::seconds(10);
// Simulated cameras share one world, which starts when all of them are ready.
constexpr Duration kReadyWithin = std::chrono::milliseconds(200);
constexpr Duration kSilentAfter = std::chrono::seconds(2);

Error silence_error(const std::string& name, Duration span) {
  return {ErrorCode::Timeout,
          fmt::format("camera '{}': no image for {:.0f} s; check that it streams and that mocapd does not hold it",
                      name, to_s(span))};
}

Status start(Camera& camera, const std::string& name, const std::stop_token& stop) {
  const Timestamp begun_at = host_now();
  for (;;) {
    const Status started = camera.start();
    if (started || started.error().code != ErrorCode::Timeout) return started;
    if (stop.stop_requested() || host_now() - begun_at > kFirstImageWithin)
      return silence_error(name, kFirstImageWithin);
  }
}

Status run(const runtime::CameraParts& parts, CameraRun& run, const std::stop_token& stop) {
  Camera& camera = *parts.camera;
  const std::string& name = parts.name;
  const Status started = start(camera, name, stop);
  if (!started) return started;
  Timestamp last_image_at = host_now();
  while (!stop.stop_requested()) {
    const Result<Frame> frame = camera.next(kPatience);
    if (frame) {
      last_image_at = host_now();
      const Result<RunState> state = run.handle(*frame, parts);
      if (!state) return state.error();
      run.images.fetch_add(1, std::memory_order_relaxed);
      if (*state == RunState::Finished) return {};
      continue;
    }
    if (frame.error().code == ErrorCode::EndOfStream) return {};
    const bool is_transient = frame.error().code == ErrorCode::Timeout || frame.error().code == ErrorCode::Io;
    if (!is_transient) return frame.error();
    const Duration timeout = run.images == 0 ? kFirstImageWithin : kSilentAfter;
    if (host_now() - last_image_at > timeout) return silence_error(name, timeout);
  }
  return Error{ErrorCode::Timeout, fmt::format("camera '{}': ended before it had delivered enough images", name)};
}

}  // namespace

void run_cameras(const settings::DaemonSettings& settings, std::vector<CameraRun>& runs,
                 const std::function<bool()>& watch) {
  settings::DaemonSettings full_speed = settings;
  for (cameras::CameraSettings& camera : full_speed.cameras) {
    if (auto* replay = camera.driver.as<cameras::ReplaySettings>()) replay->speed = 0.0;
  }
  SharedByCameras shared;
  shared.epoch = host_now() + kReadyWithin;
  std::atomic<std::size_t> running{runs.size()};
  std::vector<std::jthread> threads;
  for (std::uint32_t i = 0; i < runs.size(); ++i) {
    threads.emplace_back([&, i](const std::stop_token& stop) {
      Result<runtime::CameraParts> parts = assemble_camera(full_speed, CameraId{i}, shared);
      if (parts) {
        runs[i].end = run(*parts, runs[i], stop);
        parts->camera->stop();
      } else {
        runs[i].end = parts.error();
      }
      if (!runs[i].end) runs[i].failed.store(true);
      running.fetch_sub(1, std::memory_order_release);
    });
  }
  while (running.load(std::memory_order_acquire) > 0) {
    if (!watch()) {
      for (std::jthread& thread : threads) thread.request_stop();
    }
    std::this_thread::sleep_for(kWatchEvery);
  }
}

}  // namespace mocap::calibrate
