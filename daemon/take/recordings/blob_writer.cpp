#include <fmt/core.h>

#include "mocap/v1/blobs.pb.h"
#include "take/recordings/blob_format.h"
#include "take/recordings/blob_recording.h"
#include "take/recordings/output_file.h"
#include "wire/codec/blob_columns.h"

namespace mocap::take {
namespace {

class BlobFile final : public BlobWriter {
 public:
  explicit BlobFile(OutputFile file) : file_(std::move(file)) {}

  Status begin(std::span<const RecordedCamera> cameras) {
    v1::BlobRecording header;
    header.set_version(kBlobVersion);
    header.set_producer("mocapd");
    header.set_utc_minus_host_ns(utc_minus_host().count());
    for (const RecordedCamera& camera : cameras) {
      auto* one = header.add_cameras();
      one->set_name(camera.name);
      one->set_width_px(static_cast<std::uint32_t>(camera.width_px));
      one->set_height_px(static_cast<std::uint32_t>(camera.height_px));
    }
    header.SerializeToString(&bytes_);
    return file_.append_head(fmt::format("{}{}{}", kBlobMagic, varint(bytes_.size()), bytes_));
  }

  Status write(const BlobFrame& frame) override {
    picture_.Clear();
    picture_.set_camera(frame.camera.value);
    picture_.set_number(frame.number);
    picture_.set_exposed_at_ns(to_ns(frame.exposed_at));
    for (const Blob& blob : frame.blobs) wire::add_blob(picture_, blob);
    picture_.SerializeToString(&bytes_);
    return file_.append_delimited(bytes_);
  }

  std::string path() const override { return file_.path(); }
  RecordingSize size() const override { return file_.size(); }
  Status finish() override { return file_.finish(); }

 private:
  OutputFile file_;
  std::string bytes_;
  v1::BlobPicture picture_;
};

}  // namespace

Result<std::unique_ptr<BlobWriter>> make_blob_writer(const std::filesystem::path& path,
                                                     std::span<const RecordedCamera> cameras) {
  if (path.extension() != ".blobs") {
    return Error{ErrorCode::InvalidArgument, fmt::format("blob recording '{}': ends in '{}', expected .blobs",
                                                         path.string(), path.extension().string())};
  }
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return file.error();
  auto writer = std::make_unique<BlobFile>(std::move(*file));
  if (const Status begun = writer->begin(cameras); !begun) return begun.error();
  return std::unique_ptr<BlobWriter>(std::move(writer));
}

}  // namespace mocap::take
