// mocap-sim: a simulated capture volume. See --help.

#include <signal.h>

#include <atomic>
#include <cstdio>
#include <exception>
#include <memory>
#include <utility>

#include "base/exit_codes.h"
#include "base/log.h"
#include "gige_server.h"
#include "image_folders.h"
#include "motion_file.h"
#include "options.h"
#include "scene/volume.h"
#include "settings/faults.h"
#include "settings/rig/rig_file.h"
#include "truth_file.h"
#include "usb3_server.h"
#include "v4l2_server.h"

namespace {

using namespace mocap;  // NOLINT: the program

constexpr double kFolderSeconds = 10.0;
std::atomic<bool> end_asked{false};

int fail(const Error& error) {
  log_error("sim", error.message);
  switch (error.code) {
    case ErrorCode::InvalidArgument:
    case ErrorCode::NotFound: return kExitConfig;
    default: return kExitUnavailable;
  }
}

int run(const sim::Options& options) {
  Rig rig = scene::ring_rig(options.ring);
  if (!options.rig.empty()) {
    auto loaded = settings::load_rig(options.rig);
    if (!loaded) {
      std::fputs((settings::to_text(loaded.error()) + "\n").c_str(), stderr);
      return kExitConfig;
    }
    rig = std::move(*loaded);
  }
  if (!options.write_rig.empty()) {
    if (const auto saved = settings::save_rig(options.write_rig, rig, {}); !saved) return fail(saved.error());
  }
  auto actor = sim::make_actor(options);
  if (!actor) return fail(actor.error());
  const scene::Volume volume(std::move(*actor), std::move(rig), options.image);
  auto truth = sim::TruthFile::open(options.write_truth, volume);
  if (!truth) return fail(truth.error());

  if (options.serve) {
    const auto served = sim::serve_gige(options, volume, **truth, end_asked);
    return served ? kExitOk : fail(served.error());
  }
  if (options.usb3) {
    const auto served = sim::serve_usb3(options, volume, end_asked);
    return served ? kExitOk : fail(served.error());
  }
  if (!options.v4l2.empty()) {
    const auto served = sim::serve_v4l2(options, volume, end_asked);
    return served ? kExitOk : fail(served.error());
  }
  const sim::ImageSeries series{options.rate_hz, options.seconds > 0.0 ? options.seconds : kFolderSeconds};
  Status written;
  if (!options.folders.empty()) {
    written = sim::write_folders(options.folders, volume, series, **truth, end_asked);
  } else if (!options.write_truth.empty()) {
    written = sim::write_truth(series, **truth, end_asked);
  }
  const auto finished = (*truth)->finish();
  if (!written) return fail(written.error());
  return finished ? kExitOk : fail(finished.error());
}

}  // namespace

int main(int argc, char** argv) {
  struct sigaction action {};
  action.sa_handler = [](int) { end_asked = true; };
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  try {
    const sim::CommandLine line = sim::read_command_line(argc, argv);
    return line.exit ? *line.exit : run(line.options);
  } catch (const std::exception& exception) {
    log_error("sim", exception.what());
    return kExitSoftware;
  }
}
