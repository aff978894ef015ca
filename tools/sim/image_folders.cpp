#include "image_folders.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

namespace mocap::sim {
namespace {

/// The output folder of one camera.
class Folder {
 public:
  Folder(std::filesystem::path path, const scene::Volume& volume, std::size_t camera)
      : path_(std::move(path)), model_(volume.rig()[camera]), eye_(volume, camera) {
    pixels_.resize(static_cast<std::size_t>(model_.width_px) * static_cast<std::size_t>(model_.height_px));
  }

  Status open() {
    std::error_code error;
    std::filesystem::create_directories(path_, error);
    stamps_.open(path_ / "timestamps.csv", std::ios::trunc);
    stamps_ << "frame,time_ns\n";
    if (error || !stamps_) return refused(path_ / "timestamps.csv");
    return {};
  }

  Status write(std::uint64_t number, double t_s, double exposure_s, Timestamp exposed_at) {
    eye_.see(t_s, exposure_s, number, pixels_);
    const auto file = path_ / fmt::format("{:06}.pgm", number);
    std::ofstream image(file, std::ios::binary | std::ios::trunc);
    image << fmt::format("P5\n{} {}\n255\n", model_.width_px, model_.height_px);
    image.write(reinterpret_cast<const char*>(pixels_.data()), static_cast<std::streamsize>(pixels_.size()));
    image.close();
    if (!image) return refused(file);
    stamps_ << fmt::format("{},{}\n", number, to_ns(exposed_at));
    return {};
  }

  Status close() {
    stamps_.close();
    if (!stamps_) return refused(path_ / "timestamps.csv");
    return {};
  }

 private:
  static Error refused(const std::filesystem::path& file) {
    return {ErrorCode::Io, fmt::format("cannot write '{}'; is the disk full, or the folder not ours?", file.string())};
  }

  std::filesystem::path path_;
  const CameraModel& model_;
  scene::Eye eye_;
  std::ofstream stamps_;
  std::vector<std::byte> pixels_;
};

// Calls `write` with the number and the time of each image.
template <class Write>
Status for_each_image(const ImageSeries& series, const std::atomic<bool>& end_asked, const Write& write) {
  const auto count = static_cast<std::uint64_t>(std::llround(series.seconds * series.rate_hz));
  for (std::uint64_t number = 0; number < count; ++number) {
    if (end_asked) {
      return Error{ErrorCode::EndOfStream, fmt::format("ended by a signal after {} of {} instants", number, count)};
    }
    const double t_s = static_cast<double>(number) / series.rate_hz;
    if (const Status written = write(number, t_s, kFolderEpoch + from_s(t_s)); !written) return written;
  }
  return {};
}

}  // namespace

Status write_folders(const std::filesystem::path& folder, const scene::Volume& volume, const ImageSeries& series,
                     TruthFile& truth, const std::atomic<bool>& end_asked) {
  std::vector<std::unique_ptr<Folder>> folders;
  for (std::size_t camera = 0; camera < volume.rig().size(); ++camera) {
    folders.push_back(std::make_unique<Folder>(folder / volume.rig()[camera].name, volume, camera));
    if (const auto opened = folders.back()->open(); !opened) return opened;
  }
  const auto write = [&](std::uint64_t number, double t_s, Timestamp exposed_at) -> Status {
    for (const auto& camera : folders) {
      const auto written = camera->write(number, t_s, volume.settings().exposure_s, exposed_at);
      if (!written) return written;
    }
    truth.write(t_s, exposed_at);
    return {};
  };
  const Status ended = for_each_image(series, end_asked, write);
  for (const auto& camera : folders) {
    if (const auto closed = camera->close(); !closed) return closed;
  }
  return ended;
}

Status write_truth(const ImageSeries& series, TruthFile& truth, const std::atomic<bool>& end_asked) {
  return for_each_image(series, end_asked, [&](std::uint64_t, double t_s, Timestamp exposed_at) {
    truth.write(t_s, exposed_at);
    return Status();
  });
}

}  // namespace mocap::sim
