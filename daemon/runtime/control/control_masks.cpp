// The part of ControlWorker that executes requests about masks.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "detect/row_mask.h"
#include "runtime/control/control_answer.h"
#include "runtime/control/control_worker.h"

namespace mocap::runtime {
namespace {

constexpr double kMostCovered = 0.2;  // fraction of the image; a lamp with a larger mask should be shaded
constexpr double kMostDrawn = 0.9;    // fraction of the image; a camera that sees nothing should be taken out instead
constexpr std::size_t kMostUndoSteps = 16;

ControlAnswer no_camera(const std::string& name) {
  return plain_answer(ControlCode::NotFound, fmt::format("there is no camera '{}'", name));
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

// The answer if a learnt mask cannot be used.
std::optional<ControlAnswer> check_learnt(const MaskLearnt& learnt, const std::string& camera) {
  if (!learnt.has_pixels) {
    return plain_answer(ControlCode::Unsupported,
                        fmt::format("camera '{}' delivers blobs without pixels; learn its mask on its node (mocapctl "
                                    "--endpoint NODE mask learn), or name another camera",
                                    camera));
  }
  if (learnt.covered_share <= kMostCovered) return std::nullopt;
  return plain_answer(
      ControlCode::Failed,
      fmt::format("camera '{}': {:.1f} % of the image would be masked, expected {:.0f} % at most; shade "
                  "bright areas or lower the exposure",
                  camera, 100.0 * learnt.covered_share, 100.0 * kMostCovered));
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
    return plain_answer(ControlCode::Invalid, good.error().message);
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
    return plain_answer(
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

// Orders the cameras to learn. Returns the answer if the request is refused; else continue_to_learn() answers it.
std::optional<ControlAnswer> ControlWorker::begin_to_learn(const ControlRequest& request) {
  if (learning_) return plain_answer(ControlCode::Failed, "masks are being learnt already; wait until they are");
  if (!capturing_) {
    return plain_answer(ControlCode::Failed, "no mask can be learnt: capture is stopped; run mocapctl capture start");
  }
  MaskLearning learning;
  for (std::size_t i = 0; i < links_.cameras.size(); ++i) {
    if (request.name.empty() || description_.cameras[i].name == request.name) learning.cameras.push_back(i);
  }
  if (learning.cameras.empty()) return no_camera(request.name);
  learning.request = request;
  learning.order = ++orders_;
  learning.masks = learnt_masks();
  learning.begun = host_now();
  CameraOrder order;
  order.action = CameraAction::LearnMask;
  order.images = request.images == 0 ? kDefaultMaskImages : request.images;
  order.number = learning.order;
  for (const std::size_t camera : learning.cameras) {
    MaskLearnt late;  // of a request that was answered before
    while (links_.cameras[camera]->masks.try_pop(late)) {
    }
    static_cast<void>(links_.cameras[camera]->orders.try_push(order));
  }
  learning_ = std::move(learning);
  return std::nullopt;
}

void ControlWorker::continue_to_learn(const std::stop_token& stop) {
  if (!learning_) return;
  std::optional<ControlAnswer> answer = receive_masks(*learning_);
  if (!answer && !learning_->cameras.empty()) return;
  MaskLearning learning = *std::exchange(learning_, std::nullopt);
  if (!answer) {
    asker_ = learning.request.by;
    MainOrder keep;
    keep.masks = std::move(learning.masks);
    answer = order_main(std::move(keep), stop);
    answer->message = learning.text + answer->message;
  }
  finish(learning.request, *answer);
}

// Takes the masks that cameras have sent. Returns the answer if the request failed.
std::optional<ControlAnswer> ControlWorker::receive_masks(MaskLearning& learning) const {
  std::vector<std::size_t> missing;
  for (const std::size_t camera : learning.cameras) {
    const std::string& name = description_.cameras[camera].name;
    MaskLearnt learnt;
    if (!links_.cameras[camera]->masks.try_pop(learnt) || learnt.order != learning.order) {
      missing.push_back(camera);
      continue;
    }
    if (std::optional<ControlAnswer> failed = check_learnt(learnt, name)) return failed;
    learning.text +=
        fmt::format("camera '{}': {} polygons, {:.2f} % of the image{}\n", name, learnt.polygons.size(),
                    100.0 * learnt.covered_share,
                    learnt.moved > 0 ? fmt::format(", {} bright spots moved and are not masked", learnt.moved) : "");
    learning.masks[camera] = std::move(learnt.polygons);
  }
  learning.cameras = std::move(missing);
  const Duration patience = longest_learning(learning.request.images);
  if (learning.cameras.empty() || host_now() - learning.begun < patience) return std::nullopt;
  return plain_answer(
      ControlCode::Timeout,
      fmt::format("camera '{}' did not deliver the images in {:.0f} s; check it with mocapctl status, or "
                  "learn from fewer with --images",
                  description_.cameras[learning.cameras.front()].name, to_s(patience)));
}

void ControlWorker::stop_to_learn(std::string_view why) {
  if (!learning_) return;
  const MaskLearning learning = *std::exchange(learning_, std::nullopt);
  finish(learning.request,
         plain_answer(ControlCode::Failed, fmt::format("no mask was learnt, because {}; request it again", why)));
}

}  // namespace mocap::runtime
