#pragma once

#include <memory>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "fusion/fusion.h"
#include "runtime/pipeline.h"
#include "settings/daemon_settings.h"

namespace mocap {

/// A pipeline that is ready to be started.
struct Assembly {
  runtime::PipelineSettings settings;
  runtime::PipelineParts parts;
};

/// Makes all parts that the settings name, and opens the feed's port and the record's files. The only place that knows
/// which makes exist. The settings outlive the assembly. Fails with what the first part that could not be made says.
Result<Assembly> assemble(const settings::DaemonSettings& settings);

/// The parts of the row from blobs to skeleton, as the settings tell them.
fusion::FusionParts assemble_row(const settings::DaemonSettings& settings);

/// The row from blobs to skeleton, as the settings tell it.
std::unique_ptr<fusion::Fusion> assemble_fusion(const settings::DaemonSettings& settings);

/// One camera (which borrows from the settings: they outlive it) with its detector and its 2D tracker. A simulated
/// camera that keeps to the clock begins its motion at `epoch`, unless its settings say when.
Result<runtime::CameraParts> assemble_camera(const settings::DaemonSettings& settings, CameraId id, Timestamp epoch);

}  // namespace mocap
