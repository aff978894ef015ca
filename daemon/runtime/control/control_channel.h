#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/bounded_vector.h"
#include "base/spsc_queue.h"
#include "base/wake_signal.h"
#include "model/audit.h"
#include "model/calibration/calibration_report.h"
#include "model/description.h"
#include "model/health.h"
#include "model/image_mask.h"
#include "model/snapshot.h"

namespace mocap::runtime {

/// Result of an order.
struct OrderDone {
  std::uint64_t order = 0;  ///< number of the order
  bool done = false;
  bool unsupported = false;
  BoundedVector<char, 255> message;  ///< for the operator
};

enum class SubjectAction { Add, Remove, Reset, Fit };

/// From the control thread to the fusion thread.
struct SubjectOrder {
  std::uint64_t number = 0;
  SubjectAction action = SubjectAction::Add;
  SubjectId subject;
  SubjectFit fit;  ///< only for SubjectAction::Fit
};

enum class CameraAction { Start, Stop, Adjust, LearnMask };

/// From the control thread to one camera's thread.
struct CameraOrder {
  std::uint64_t number = 0;
  CameraAction action = CameraAction::Start;
  std::optional<double> exposure_us;
  std::optional<double> gain_db;
  std::uint32_t images = 0;  ///< number of images, only for CameraAction::LearnMask
};

/// Result of a LearnMask order.
struct MaskLearnt {
  std::uint64_t order = 0;
  std::vector<MaskPolygon> polygons;
  std::size_t moved = 0;  ///< bright regions that moved and are therefore not masked
  double covered_share = 0.0;
  bool has_pixels = true;  ///< false: the camera delivers blobs alone, and nothing was learned
};

/// The drawn masks of one camera, all of them.
struct DrawnMasks {
  CameraId camera;
  std::vector<MaskPolygon> polygons;
};

/// From the control thread to the main thread: reload the configuration, after an optional change of it or of the rig.
struct MainOrder {
  std::uint64_t number = 0;
  std::vector<std::vector<MaskPolygon>> masks;  ///< by CameraId: learnt masks to save; empty: no change
  std::optional<DrawnMasks> drawn;              ///< drawn masks to save
  std::string subject;                          ///< name of a subject to add to the configuration; empty: none
  std::string marker_set;                       ///< absolute path of the new subject's marker set file
  std::string marker_set_text;                  ///< content of this file, which is to be written, instead of its path
  std::optional<CalibratedRig> rig;             ///< a rig to write and use
  std::string restore;                          ///< name of an earlier rig to use again; empty: none
  bool list_rigs = false;                       ///< lists the earlier rigs, and changes nothing
  AuditActor by;                                ///< who ordered
};

/// Answer of the main thread; the message may have several lines.
struct MainDone {
  std::uint64_t order = 0;
  bool done = false;
  std::string message;
  bool change_follows = false;     ///< the main thread changes the pipeline next: a request must wait until then
  std::vector<KeptRig> rigs = {};  ///< of list_rigs
};

/// Queues between the control thread and the other threads. The thread that receives an order answers it.
struct ControlChannel {
  SpscQueue<SubjectOrder> to_fusion{4};
  SpscQueue<OrderDone> from_fusion{4};
  WakeSignal* wake_fusion = nullptr;
  SpscQueue<Health> health{2};             ///< publish thread to control thread, with each report
  SpscQueue<Description> descriptions{4};  ///< publish thread to control thread, when it changes
  SpscQueue<Snapshot> snapshots{1};        ///< publish thread to control thread, if snapshot_wanted
  std::atomic<bool> snapshot_wanted{false};
  std::array<std::atomic<int>, kMaxSubjects> phases{};  ///< SubjectPhase by SubjectId; set by the publish thread
  SpscQueue<MainOrder> to_main{2};
  SpscQueue<MainDone> from_main{2};
};

}  // namespace mocap::runtime
