// mocap_video.so: reads videos with OpenCV for the replay camera. See cameras/replay/video_file.h.
#include <cstring>
#include <exception>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <string>

#include "cameras/replay/video_file.h"

namespace mocap::cameras {
namespace {

class OpenCvVideo final : public VideoFile {
 public:
  bool open(const std::filesystem::path& video) { return video_.open(video.string()); }

  Result<GreyImage> next() override try {
    if (!video_.read(read_)) return Error{ErrorCode::EndOfStream, "the video is through"};
    if (read_.channels() == 1) {
      grey_ = read_;
    } else {
      // Luminance from blue, green and red (ITU-R BT.601). The pixels of a grey recording stay the same.
      cv::transform(read_, grey_, cv::Matx13f(0.114F, 0.587F, 0.299F));
    }
    GreyImage image{grey_.cols, grey_.rows, std::vector<std::byte>(grey_.total())};
    for (int row = 0; row < grey_.rows; ++row) {
      std::memcpy(image.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(grey_.cols),
                  grey_.ptr(row), static_cast<std::size_t>(grey_.cols));
    }
    return image;
  } catch (const std::exception& failure) {  // cv::Exception, or no memory for the image
    return Error{ErrorCode::Io, failure.what()};
  }

 private:
  cv::VideoCapture video_;
  cv::Mat read_;  // in the video's colours
  cv::Mat grey_;
};

}  // namespace
}  // namespace mocap::cameras

extern "C" __attribute__((visibility("default"))) mocap::cameras::VideoFile* mocap_open_video(
    const std::filesystem::path& video, std::string& why) try {
  auto file = std::make_unique<mocap::cameras::OpenCvVideo>();
  if (file->open(video)) return file.release();
  why = "not a format that OpenCV reads here";
  return nullptr;
} catch (const std::exception& failure) {
  why = failure.what();
  return nullptr;
}
