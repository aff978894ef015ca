#include <fmt/core.h>
#include <google/protobuf/io/coded_stream.h>

#include <cmath>
#include <filesystem>
#include <optional>

#include "base/read_file.h"
#include "mocap/v1/blobs.pb.h"
#include "model/image_bounds.h"
#include "take/recordings/blob_format.h"
#include "take/recordings/blob_recording.h"
#include "wire/codec/blob_columns.h"

namespace mocap::take {
namespace {

class Reader {
 public:
  Reader(std::string name, std::string bytes) : name_(std::move(name)), bytes_(std::move(bytes)) {}

  Result<BlobRecording> read() {
    if (!std::string_view(bytes_).starts_with(kBlobMagic)) {
      return Error{
          ErrorCode::InvalidArgument,
          fmt::format("'{}' is no blob recording: wrong first bytes; expected a file that mocapd ([record] blobs) or "
                      "mocap-calibrate (--record) wrote",
                      name_)};
    }
    at_ = kBlobMagic.size();
    if (const Status begun = read_header(); !begun) return begun.error();
    v1::BlobPicture picture;
    while (at_ < bytes_.size() && !recording_.cut_off) {
      const std::size_t from = at_;
      const auto message = next();
      if (!message) break;
      picture.Clear();
      if (!picture.ParseFromArray(message->data(), static_cast<int>(message->size())))
        return damaged(from, "an image that cannot be decoded");
      if (const Status taken = take(picture, from); !taken) return taken.error();
    }
    return std::move(recording_);
  }

 private:
  Error damaged(std::size_t from, const std::string& what) const {
    return {ErrorCode::InvalidArgument,
            fmt::format("blob recording '{}' is damaged at byte {}: {}; record again", name_, from, what)};
  }

  // Returns the next message, or nothing and sets cut_off if the file ends within the message.
  std::optional<std::string_view> next() {
    google::protobuf::io::CodedInputStream stream(reinterpret_cast<const std::uint8_t*>(bytes_.data()) + at_,
                                                  static_cast<int>(std::min<std::size_t>(10, bytes_.size() - at_)));
    std::uint64_t size = 0;
    if (!stream.ReadVarint64(&size) ||
        size > bytes_.size() - at_ - static_cast<std::size_t>(stream.CurrentPosition())) {
      recording_.cut_off = true;
      return std::nullopt;
    }
    const std::size_t from = at_ + static_cast<std::size_t>(stream.CurrentPosition());
    at_ = from + size;
    return std::string_view(bytes_).substr(from, size);
  }

  Status read_header() {
    const auto message = next();
    v1::BlobRecording header;
    if (!message || !header.ParseFromArray(message->data(), static_cast<int>(message->size())))
      return damaged(kBlobMagic.size(), "its header cannot be decoded");
    if (header.version() < 1 || header.version() > kBlobVersion) {
      return Error{ErrorCode::Unsupported,
                   fmt::format("blob recording '{}' has version {}, expected 1 to {}; use the mocapd that wrote it",
                               name_, header.version(), kBlobVersion)};
    }
    if (header.cameras().empty() || header.cameras_size() > static_cast<int>(kMaxCameras))
      return damaged(kBlobMagic.size(),
                     fmt::format("{} cameras, expected 1 to {}", header.cameras_size(), kMaxCameras));
    for (const auto& camera : header.cameras()) {
      if (camera.name().empty() || camera.width_px() > kMaxImageSide_px || camera.height_px() > kMaxImageSide_px)
        return damaged(kBlobMagic.size(), "a camera without name, or with an image of impossible size");
      recording_.cameras.push_back(
          {camera.name(), static_cast<int>(camera.width_px()), static_cast<int>(camera.height_px())});
    }
    recording_.pictures.resize(recording_.cameras.size());
    return {};
  }

  Status take(const v1::BlobPicture& picture, std::size_t from) {
    if (picture.camera() >= recording_.cameras.size())
      return damaged(from, fmt::format("an image of camera {} of {}", picture.camera(), recording_.cameras.size()));
    const int n = picture.x_px_size();
    if (!wire::columns_agree(picture) || n > static_cast<int>(kMaxBlobs))
      return damaged(from, "columns of different length, or more blobs than an image may have");
    auto& pictures = recording_.pictures[picture.camera()];
    RecordedPicture one{picture.number(), from_ns(picture.exposed_at_ns()), {}};
    if (!pictures.empty() && one.exposed_at <= pictures.back().exposed_at)
      return damaged(from, fmt::format("an image of camera '{}' that is not later than the one before",
                                       recording_.cameras[picture.camera()].name));
    for (int i = 0; i < n; ++i) {
      const Blob blob = wire::blob_at(picture, i);
      if (!blob.centroid.v.allFinite() || !std::isfinite(blob.sigma_px) || !(blob.sigma_px > 0.0))
        return damaged(from, "a blob without a valid position or sigma");
      one.blobs.push_back(blob);
    }
    pictures.push_back(std::move(one));
    return {};
  }

  std::string name_;
  std::string bytes_;
  std::size_t at_ = 0;
  BlobRecording recording_;
};

}  // namespace

Result<BlobRecording> read_blob_recording(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return Error{ErrorCode::NotFound, fmt::format("blob recording '{}': no such file", path.string())};
  }
  Result<std::string> bytes = read_file(path);
  if (!bytes) return Error{ErrorCode::Io, fmt::format("blob recording {}", bytes.error().message)};
  return Reader(path.string(), *std::move(bytes)).read();
}

}  // namespace mocap::take
