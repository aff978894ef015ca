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
#include "model/description.h"
#include "model/health.h"
#include "model/image_mask.h"
#include "model/snapshot.h"

namespace mocap::runtime {

/// What became of an order.
struct OrderDone {
  std::uint64_t order = 0;  ///< its number
  bool done = false;
  bool unsupported = false;
  BoundedVector<char, 255> message;  ///< for people
};

enum class SubjectAction { Add, Remove, Reset, Fit };

/// From the control thread to the fusion thread.
struct SubjectOrder {
  std::uint64_t number = 0;
  SubjectAction action = SubjectAction::Add;
  SubjectId subject;
  SubjectFit fit;  ///< of Fit
};

enum class CameraAction { Start, Stop, Adjust, LearnMask };

/// From the control thread to one camera's thread.
struct CameraOrder {
  std::uint64_t number = 0;
  CameraAction action = CameraAction::Start;
  std::optional<double> exposure_us;
  std::optional<double> gain_db;
  std::uint32_t images = 0;  ///< of LearnMask
};

/// What a camera's thread learnt for LearnMask.
struct MaskLearnt {
  std::uint64_t order = 0;
  std::vector<MaskPolygon> polygons;
  std::size_t moved = 0;  ///< bright regions that are not masked, for they moved
  double covered_share = 0.0;
};

/// From the control thread to the main thread: what concerns the daemon as a whole.
struct MainOrder {
  std::uint64_t number = 0;
  std::vector<std::vector<MaskPolygon>> masks;  ///< by CameraId: to be kept before the configuration is read anew
  std::string subject;                          ///< a new one, to be added to the configuration
  std::string marker_set;                       ///< what it wears: the absolute path of a file
};

/// What the main thread says: it may be more than a line.
struct MainDone {
  std::uint64_t order = 0;
  bool done = false;
  std::string message;
};

/// The ways between the control thread and the others. Orders are rare; each is answered by the thread that it goes to.
struct ControlChannel {
  SpscQueue<SubjectOrder> to_fusion{4};
  SpscQueue<OrderDone> from_fusion{4};
  WakeSignal* wake_fusion = nullptr;
  SpscQueue<Health> health{2};             ///< publish thread to control thread, as reported
  SpscQueue<Description> descriptions{4};  ///< publish thread to control thread, when it changes
  SpscQueue<Snapshot> snapshots{1};        ///< publish thread to control thread, when asked for
  std::atomic<bool> snapshot_wanted{false};
  std::array<std::atomic<int>, kMaxSubjects> phases{};  ///< SubjectPhase of each subject, by the publish thread
  SpscQueue<MainOrder> to_main{2};
  SpscQueue<MainDone> from_main{2};
};

}  // namespace mocap::runtime
