// The part of ControlWorker that executes requests about masks.
#include <fmt/format.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "detect/row_mask.h"
#include "runtime/control/control_worker.h"

namespace mocap::runtime {
namespace {

constexpr Duration kMaskPatience = std::chrono::seconds(60);
constexpr Duration kMaskPollPeriod = std::chrono::milliseconds(1);
constexpr std::uint32_t kMaskImages = 100;
constexpr double kMostCovered = 0.2;  // fraction of the image; a lamp with a larger mask should be shaded
constexpr double kMostDrawn = 0.9;    // fraction of the image; a camera that sees nothing should be taken out instead
constexpr std::size_t kMostUndoSteps = 16;

ControlAnswer mask_failure(ControlCode code, std::string message) {
  ControlAnswer answer;
  answer.code = code;
  answer.message = std::move(message);
  return answer;
}

ControlAnswer no_camera(const std::string& name) {
  return mask_failure(ControlCode::NotFound, fmt::format("there is no camera '{}'", name));
}

// Whether the polygon has no pixel of the image.
bool is_outside(const MaskPolygon& polygon, const CameraModel& camera) {
  return detect::RowMask({&polygon, 1}, camera.width_px, camera.height_px).count() == 0;
}

double covered_share(std::span<const MaskPolygon> polygons, const CameraModel& camera) {
  const auto pixels = static_cast<double>(camera.width_px) * static_cast<double>(camera.height_px);
  return static_cast<double>(detect::RowMask(polygons, camera.width_px, camera.height_px).count()) / pixels;
}

bool has_size(const CameraModel& camera) { return camera.width_px > 0 && camera.height_px > 0; }

Status check_drawn(const std::vector<MaskPolygon>& polygons, const CameraModel& camera) {
  if (!has_size(camera)) return {};
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    if (!is_outside(polygons[i], camera)) continue;
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("camera '{}': polygon {} covers no pixel of the image, expected corners within 0 to {} and 0 to {}",
                    camera.name, i + 1, camera.width_px - 1, camera.height_px - 1)};
  }
  const double share = covered_share(polygons, camera);
  if (share <= kMostDrawn) return {};
  return Error{
      ErrorCode::InvalidArgument,
      fmt::format("camera '{}': {:.1f} % of the image would be masked, expected {:.0f} % at most; take the camera "
                  "out of the configuration instead",
                  camera.name, 100.0 * share, 100.0 * kMostDrawn)};
}

std::string drawn_text(const std::vector<MaskPolygon>& polygons, const CameraModel& camera) {
  const std::string share = has_size(camera)
                                ? fmt::format(", {:.2f} % of the image", 100.0 * covered_share(polygons, camera))
                                : std::string();
  return fmt::format("camera '{}': {} drawn masks{}\n", camera.name, polygons.size(), share);
}

}  // namespace

std::vector<std::vector<MaskPolygon>> ControlWorker::learnt_masks() const {
  std::vector<std::vector<MaskPolygon>> masks;
  for (const CameraModel& camera : description_.cameras) masks.push_back(camera.learnt_masks);
  return masks;
}

ControlAnswer ControlWorker::list_masks(const ControlRequest& request) const {
  ControlAnswer answer;
  std::vector<CameraMasks>& all = answer.masks.emplace();
  for (const CameraModel& camera : description_.cameras) {
    if (!request.name.empty() && camera.name != request.name) continue;
    const auto before = drawn_before_.find(camera.name);
    all.push_back({camera.name, camera.width_px, camera.height_px, camera.masks, camera.learnt_masks,
                   before == drawn_before_.end() ? 0 : before->second.size()});
  }
  return all.empty() && !request.name.empty() ? no_camera(request.name) : answer;
}

ControlAnswer ControlWorker::change_masks(const ControlRequest& request, const std::stop_token& stop) {
  const std::optional<std::size_t> camera = find_camera(request.name);
  if (!camera) return no_camera(request.name);
  switch (request.action) {
    case ControlAction::ForgetMasks: return forget_masks(*camera, stop);
    case ControlAction::UndoMasks: return undo_masks(*camera, stop);
    default: return draw_masks(*camera, request.polygons, stop);
  }
}

ControlAnswer ControlWorker::draw_masks(std::size_t camera, const std::vector<MaskPolygon>& polygons,
                                        const std::stop_token& stop) {
  const CameraModel model = description_.cameras[camera];
  if (const Status good = check_drawn(polygons, model); !good) {
    return mask_failure(ControlCode::Invalid, good.error().message);
  }
  ControlAnswer drawn = save_drawn(camera, polygons, stop);
  if (drawn.code != ControlCode::Done) return drawn;
  std::deque<std::vector<MaskPolygon>>& before = drawn_before_[model.name];
  if (before.size() == kMostUndoSteps) before.pop_front();
  before.push_back(model.masks);
  return drawn;
}

ControlAnswer ControlWorker::undo_masks(std::size_t camera, const std::stop_token& stop) {
  const auto before = drawn_before_.find(description_.cameras[camera].name);
  if (before == drawn_before_.end() || before->second.empty()) {
    return mask_failure(
        ControlCode::Invalid,
        fmt::format("camera '{}': no mask was drawn since the daemon started, so there is nothing to undo",
                    description_.cameras[camera].name));
  }
  ControlAnswer undone = save_drawn(camera, before->second.back(), stop);
  if (undone.code == ControlCode::Done) before->second.pop_back();
  return undone;
}

ControlAnswer ControlWorker::save_drawn(std::size_t camera, const std::vector<MaskPolygon>& polygons,
                                        const std::stop_token& stop) {
  const std::string text = drawn_text(polygons, description_.cameras[camera]);
  MainOrder order;
  order.drawn = {CameraId{static_cast<std::uint32_t>(camera)}, polygons};
  ControlAnswer answer = order_main(std::move(order), stop);
  if (answer.code == ControlCode::Done) answer.message = text + answer.message;
  return answer;
}

ControlAnswer ControlWorker::forget_masks(std::size_t camera, const std::stop_token& stop) {
  const std::string text =
      fmt::format("camera '{}': {} learnt masks are discarded\n", description_.cameras[camera].name,
                  description_.cameras[camera].learnt_masks.size());
  MainOrder order;
  order.masks = learnt_masks();
  order.masks[camera].clear();
  ControlAnswer answer = order_main(std::move(order), stop);
  if (answer.code == ControlCode::Done) answer.message = text + answer.message;
  return answer;
}

ControlAnswer ControlWorker::learn_mask(const ControlRequest& request, const std::stop_token& stop) {
  std::vector<std::size_t> cameras;
  for (std::size_t i = 0; i < links_.cameras.size(); ++i) {
    if (request.name.empty() || description_.cameras[i].name == request.name) cameras.push_back(i);
  }
  if (cameras.empty()) return no_camera(request.name);
  CameraOrder order;
  order.action = CameraAction::LearnMask;
  order.images = request.images == 0 ? kMaskImages : request.images;
  order.number = ++orders_;
  for (const std::size_t camera : cameras) static_cast<void>(links_.cameras[camera]->orders.try_push(order));
  std::vector<std::vector<MaskPolygon>> masks = learnt_masks();
  std::string text;
  const Timestamp begun = host_now();
  for (const std::size_t camera : cameras) {
    const std::string& name = description_.cameras[camera].name;
    MaskLearnt learnt;
    const auto received = [&] { return links_.cameras[camera]->masks.try_pop(learnt) && learnt.order == order.number; };
    bool here = received();
    while (!here && !stop.stop_requested() && host_now() - begun < kMaskPatience) {
      std::this_thread::sleep_for(kMaskPollPeriod);
      here = received();
    }
    if (!here)
      return mask_failure(ControlCode::Timeout,
                          fmt::format("camera '{}' did not answer in time; the request may still be executed", name));
    if (!learnt.has_pixels) {
      return mask_failure(ControlCode::Unsupported,
                          fmt::format("camera '{}' delivers blobs without pixels; learn its mask on its node (mocapctl "
                                      "--endpoint NODE mask learn), or name another camera",
                                      name));
    }
    if (learnt.covered_share > kMostCovered) {
      return mask_failure(
          ControlCode::Failed,
          fmt::format("camera '{}': {:.1f} % of the image would be masked, expected {:.0f} % at most; shade "
                      "bright areas or lower the exposure",
                      name, 100.0 * learnt.covered_share, 100.0 * kMostCovered));
    }
    text +=
        fmt::format("camera '{}': {} polygons, {:.2f} % of the image{}\n", name, learnt.polygons.size(),
                    100.0 * learnt.covered_share,
                    learnt.moved > 0 ? fmt::format(", {} bright spots moved and are not masked", learnt.moved) : "");
    masks[camera] = std::move(learnt.polygons);
  }
  MainOrder keep;
  keep.masks = std::move(masks);
  ControlAnswer kept = order_main(std::move(keep), stop);
  kept.message = text + kept.message;
  return kept;
}

}  // namespace mocap::runtime
