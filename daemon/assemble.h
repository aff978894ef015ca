#pragma once

#include <memory>
#include <string>
#include <vector>

#include "assemble_camera.h"
#include "base/result.h"
#include "base/time.h"
#include "fusion/fusion.h"
#include "model/handover.h"
#include "module/audit_trail.h"
#include "module/search_explainer.h"
#include "runtime/pipeline.h"
#include "settings/daemon_settings.h"

namespace mocap {

/// A pipeline that is ready to be started. Outlives the pipeline.
struct Assembly {
  std::unique_ptr<SharedByCameras> shared;
  runtime::PipelineSettings settings;
  runtime::PipelineParts parts;
};

/// Constructs all parts according to the settings, and opens the feed's port and the recording files. Only assemble.cpp
/// and assemble_camera.cpp know which implementations of the interfaces exist. The settings outlive the assembly. Fails
/// with the error of the first part that cannot be constructed. `audit`: outlives the pipeline; null: nothing is noted.
Result<Assembly> assemble(const settings::DaemonSettings& settings, AuditTrail* audit = nullptr);

/// Constructs the change of a running pipeline from one configuration to another: only the parts that must differ.
/// Opens new recordings; cameras and ports are opened by the change. `shared`: of the Assembly of the run. Fails, with
/// no effect on the pipeline, if a part cannot be constructed. Requires is_replay() of both to be equal.
Result<runtime::PipelineChange> assemble_change(const settings::DaemonSettings& before,
                                                const settings::DaemonSettings& now, const runtime::Pipeline& pipeline,
                                                SharedByCameras& shared, AuditTrail* audit = nullptr);

/// Fails if a daemon with the settings `before` could not open the endpoints and ports of `now`: the address is not of
/// this machine, another program uses the port, `now` uses it twice, or the folder of an ipc endpoint is not writable.
Status check_ports(const settings::DaemonSettings& before, const settings::DaemonSettings& now);

/// The description of a run with these settings, before any fit. `session_id`: of the run.
Description describe(const settings::DaemonSettings& settings, std::string session_id);

/// Whether all images come from recordings, so that the run has the recorded time.
bool is_replay(const settings::DaemonSettings& settings);

/// The parts of the running configuration that continue in the next one.
Handover handover_between(const settings::DaemonSettings& before, const settings::DaemonSettings& now);

/// Constructs the parts of the fusion, from matcher to skeleton solver, according to the settings.
fusion::FusionParts assemble_fusion_parts(const settings::DaemonSettings& settings);

/// Constructs the fusion with the parts of `assemble_fusion_parts`.
std::unique_ptr<fusion::Fusion> assemble_fusion(const settings::DaemonSettings& settings);

/// Constructs the explainer of failed searches, with the thresholds of the search and the marker sets of the
/// installation.
std::unique_ptr<SearchExplainer> assemble_explainer(const settings::DaemonSettings& settings);

}  // namespace mocap
