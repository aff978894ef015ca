#include "calibrate/run_cameras.h"

#include <fmt/format.h>

#include <thread>
#include <utility>

#include "assemble.h"
#include "cameras/replay/replay_settings.h"

namespace mocap::calibrate {
namespace {

constexpr Duration kPatience = std::chrono::milliseconds(50);
constexpr Duration kWatchEvery = std::chrono::milliseconds(100);
// A camera that is looked for, or that was just told to begin, takes its time.
constexpr Duration kFirstImageWithin = std::chrono::seconds(10);
// Simulated cameras show one world, which begins when all of them stand ready.
constexpr Duration kReadyWithin = std::chrono::milliseconds(200);
constexpr Duration kSilentAfter = std::chrono::seconds(2);

Error silent(const std::string& name, Duration span) {
  return {ErrorCode::Timeout, fmt::format("camera '{}': no image for {:.0f} s; does it stream? mocapd must not have it "
                                          "open at the same time",
                                          name, to_s(span))};
}

Status start(Camera& camera, const std::string& name, const std::stop_token& stop) {
  const Timestamp begun_at = host_now();
  for (;;) {
    const Status started = camera.start();
    if (started || started.error().code != ErrorCode::Timeout) return started;
    if (stop.stop_requested() || host_now() - begun_at > kFirstImageWithin) return silent(name, kFirstImageWithin);
  }
}

Status run(const runtime::CameraParts& parts, CameraRun& run, const std::stop_token& stop) {
  Camera& camera = *parts.camera;
  const std::string& name = parts.name;
  const Status started = start(camera, name, stop);
  if (!started) return started;
  Timestamp heard_at = host_now();
  while (!stop.stop_requested()) {
    const Result<Frame> frame = camera.next(kPatience);
    if (frame) {
      heard_at = host_now();
      const Result<Wish> wish = run.take(*frame, parts);
      if (!wish) return wish.error();
      run.images.fetch_add(1, std::memory_order_relaxed);
      if (*wish == Wish::Enough) return {};
      continue;
    }
    if (frame.error().code == ErrorCode::EndOfStream) return {};
    const bool may_go_on = frame.error().code == ErrorCode::Timeout || frame.error().code == ErrorCode::Io;
    if (!may_go_on) return frame.error();
    const Duration allowed = run.images == 0 ? kFirstImageWithin : kSilentAfter;
    if (host_now() - heard_at > allowed) return silent(name, allowed);
  }
  return Error{ErrorCode::Timeout, fmt::format("camera '{}': ended before it had enough", name)};
}

}  // namespace

void run_cameras(const settings::DaemonSettings& settings, std::vector<CameraRun>& runs,
                 const std::function<bool()>& watch) {
  settings::DaemonSettings hurried = settings;
  for (cameras::CameraSettings& camera : hurried.cameras) {
    if (auto* replay = camera.driver.as<cameras::ReplaySettings>()) replay->speed = 0.0;
  }
  const Timestamp epoch = host_now() + kReadyWithin;
  std::atomic<std::size_t> running{runs.size()};
  std::vector<std::jthread> threads;
  for (std::uint32_t i = 0; i < runs.size(); ++i) {
    threads.emplace_back([&, i](const std::stop_token& stop) {
      Result<runtime::CameraParts> parts = assemble_camera(hurried, CameraId{i}, epoch);
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
