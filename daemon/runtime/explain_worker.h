#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "module/search_explainer.h"
#include "runtime/camera/camera_worker.h"
#include "runtime/fusion_worker.h"

namespace mocap::runtime {

/// The explain thread: finds the reason why a subject is not found, and passes it to the publish thread. Logs a new
/// cause. A slow explanation delays the next one alone.
class ExplainWorker {
 public:
  /// The channels outlive the worker. `subjects`: their names, by SubjectId.
  ExplainWorker(std::unique_ptr<SearchExplainer> explainer, std::vector<std::string> subjects,
                std::vector<CameraChannel*> cameras, SearchChannel& search);

  /// The loop; returns when stopped.
  void run(const std::stop_token& stop);

 private:
  void explain(const SearchReport& report);
  void look_at_cameras();

  /// Counts at the last look.
  struct Seen {
    std::uint64_t frames = 0;
    DetectionCounts detection;
    Timestamp at;
  };

  std::unique_ptr<SearchExplainer> explainer_;
  std::vector<std::string> subjects_;
  std::vector<CameraChannel*> cameras_;
  SearchChannel& search_;
  std::vector<Seen> seen_;           // by camera
  std::vector<CameraSight> sights_;  // by camera
  std::vector<SearchCause> logged_;  // by subject
};

}  // namespace mocap::runtime
