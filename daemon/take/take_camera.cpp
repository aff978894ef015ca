#include "take/take_camera.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "base/log.h"
#include "take/take_reader.h"
#include "take/take_writer.h"

namespace mocap::take {
namespace {

class PlayedCamera : public BlobCamera {
 public:
  PlayedCamera(CameraId id, std::string name, TakeCameraSettings settings)
      : id_(id), name_(std::move(name)), settings_(std::move(settings)) {}

  Status start() override;
  Result<Frame> next(Duration patience) override;
  void stop() noexcept override {
    cursor_.reset();
    take_.reset();
  }
  const Blobs& blobs() const override { return image_.blobs; }

 private:
  Status open();
  Result<const BlobFrame*> upcoming();
  void rewind();
  bool wait_until_due(Timestamp exposed_at, Duration patience);
  Error error(ErrorCode code, const std::string& what) const {
    return {code, fmt::format("camera '{}': {}", name_, what)};
  }

  CameraId id_;
  std::string name_;
  TakeCameraSettings settings_;
  std::unique_ptr<TakeReader> take_;  // null: not started
  std::unique_ptr<TakeCursor> cursor_;
  std::vector<std::byte> black_;
  int width_px_ = 0, height_px_ = 0;
  std::optional<BlobFrame> coming_;  // read, not yet due
  BlobFrame image_;                  // the last one
  std::uint64_t images_ = 0;         // of this pass
  std::uint64_t pass_number_ = 0;
  Duration pass_time_{};  // added to the recorded times in this pass
  std::uint64_t first_number_ = 0;
  Timestamp first_exposed_;  // of the recording
  std::optional<Timestamp> first_due_;
};

Status PlayedCamera::start() {
  stop();
  if (const Status opened = open(); !opened) {
    stop();
    return opened;
  }
  coming_.reset();
  images_ = 0;
  pass_number_ = 0;
  pass_time_ = Duration::zero();
  first_due_.reset();
  log_info("camera " + name_,
           fmt::format("started driver=replay file={} speed={}", settings_.file.string(), settings_.speed));
  return {};
}

Status PlayedCamera::open() {
  Result<TakeReader> opened = TakeReader::open(settings_.file);
  if (!opened) return error(opened.error().code, opened.error().message);
  take_ = std::make_unique<TakeReader>(*std::move(opened));
  const Result<Description> description = take_->description();
  if (!description) return error(description.error().code, description.error().message);
  const auto found = std::ranges::find(description->cameras, name_, &CameraModel::name);
  if (found == description->cameras.end()) {
    std::vector<std::string> names;
    for (const CameraModel& camera : description->cameras) names.push_back(camera.name);
    return error(ErrorCode::NotFound, fmt::format("'{}' has no camera of this name, only {}", settings_.file.string(),
                                                  fmt::join(names, ", ")));
  }
  width_px_ = found->width_px;
  height_px_ = found->height_px;
  black_.assign(static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_), std::byte{0});
  rewind();
  return {};
}

void PlayedCamera::rewind() {
  cursor_ = std::make_unique<TakeCursor>(take_->messages({.topics = {TakeTopic::Blobs}, .camera = name_}));
}

// The next image of this pass; null at the end.
Result<const BlobFrame*> PlayedCamera::upcoming() {
  if (coming_) return &*coming_;
  const Result<std::optional<TakeRecord>> record = cursor_->next();
  if (!record) return error(ErrorCode::Io, record.error().message);
  if (!*record) return nullptr;
  Result<BlobFrame> read = blobs_of(**record);
  if (!read) return error(ErrorCode::Io, read.error().message);
  coming_ = *std::move(read);
  coming_->camera = id_;
  if (images_ == 0 && pass_number_ == 0) {
    first_number_ = coming_->number;
    first_exposed_ = coming_->exposed_at;
  }
  coming_->number += pass_number_;
  coming_->exposed_at += pass_time_;
  return &*coming_;
}

bool PlayedCamera::wait_until_due(Timestamp exposed_at, Duration patience) {
  if (settings_.speed <= 0.0) return true;
  const Timestamp now = host_now();
  if (!first_due_) first_due_ = now;
  const Timestamp due = *first_due_ + from_s(to_s(exposed_at - first_exposed_) / settings_.speed);
  if (due > now + patience) {
    std::this_thread::sleep_for(patience);
    return false;
  }
  std::this_thread::sleep_until(due);
  return true;
}

Result<Frame> PlayedCamera::next(Duration patience) {
  if (!take_) return error(ErrorCode::DeviceLost, "not started");
  Result<const BlobFrame*> coming = upcoming();
  if (!coming) return coming.error();
  if (*coming == nullptr) {
    if (!settings_.loop || images_ < 2) return error(ErrorCode::EndOfStream, "the take has ended");
    const Duration pass = image_.exposed_at - pass_time_ - first_exposed_;
    pass_time_ += pass + pass / static_cast<Duration::rep>(images_ - 1);
    pass_number_ = image_.number + 1 - first_number_;
    images_ = 0;
    rewind();
    return next(patience);
  }
  if (!wait_until_due((*coming)->exposed_at, patience)) return Error{ErrorCode::Timeout, {}};
  image_ = **coming;
  coming_.reset();
  ++images_;
  Frame frame;
  frame.camera = id_;
  frame.number = image_.number;
  frame.exposed_at = image_.exposed_at;
  frame.received_at = image_.exposed_at;
  frame.image = {black_, static_cast<std::size_t>(width_px_), width_px_, height_px_, PixelFormat::Mono8};
  return frame;
}

}  // namespace

std::unique_ptr<BlobCamera> make_take_camera(CameraId id, std::string name, TakeCameraSettings settings) {
  return std::make_unique<PlayedCamera>(id, std::move(name), std::move(settings));
}

}  // namespace mocap::take
