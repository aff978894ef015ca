#include "calibration/plugin_calibrator.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include "base/install_folders.h"

namespace mocap::calibration {
namespace {

// The plug-in stays loaded until the program ends: OpenCV's libraries do not support unloading.
Result<std::unique_ptr<RigCalibrator>> load_plugin(const RigBefore& known, int threads) {
  const std::filesystem::path file = install_folders().plugins / "mocap_calibration.so";
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* const function = library != nullptr ? dlsym(library, "mocap_make_calibrator") : nullptr;
  if (function != nullptr) {
    return std::unique_ptr<RigCalibrator>(reinterpret_cast<MakeCalibrator*>(function)(known, threads));
  }
  const char* const why = dlerror();
  return Error{ErrorCode::Unsupported,
               fmt::format("cannot load the plug-in that computes rigs: {}; it is in the package mocap-tools",
                           why != nullptr ? why : file.string())};
}

}  // namespace

Status PluginCalibrator::start(const CalibrationOrder& order) {
  if (!loaded_) {
    Result<std::unique_ptr<RigCalibrator>> loaded = load_plugin(known_, threads_);
    if (!loaded) return loaded.error();
    loaded_ = std::move(*loaded);
  }
  return loaded_->start(order);
}

bool PluginCalibrator::add(std::size_t camera, const CalibrationImage& image) {
  return loaded_ && loaded_->add(camera, image);
}

void PluginCalibrator::solve(const CalibrationProgress& progress) {
  if (loaded_) loaded_->solve(progress);
}

CalibrationReport PluginCalibrator::report() const { return loaded_ ? loaded_->report() : CalibrationReport{}; }

}  // namespace mocap::calibration
