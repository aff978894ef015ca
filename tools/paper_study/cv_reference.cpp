#include "paper_study/cv_reference.h"

#include <opencv2/video/tracking.hpp>

namespace mocap::paper_study {

struct CvReference::Tracks {
  std::vector<cv::KalmanFilter> filters;
  cv::Mat measured = cv::Mat(2, 1, CV_32F);  // not braces: they would select the initializer_list constructor
};

namespace {

cv::KalmanFilter filter_at(const Eigen::Vector2d& point_px) {
  cv::KalmanFilter filter(4, 2, 0, CV_32F);
  cv::setIdentity(filter.transitionMatrix);
  filter.transitionMatrix.at<float>(0, 2) = 1.0F;
  filter.transitionMatrix.at<float>(1, 3) = 1.0F;
  cv::setIdentity(filter.measurementMatrix);
  cv::setIdentity(filter.processNoiseCov, cv::Scalar::all(0.1));
  cv::setIdentity(filter.measurementNoiseCov, cv::Scalar::all(0.01));
  cv::setIdentity(filter.errorCovPost, cv::Scalar::all(10.0));
  filter.statePost.at<float>(0) = static_cast<float>(point_px.x());
  filter.statePost.at<float>(1) = static_cast<float>(point_px.y());
  return filter;
}

}  // namespace

CvReference::CvReference(double gate_px) : tracks_(std::make_unique<Tracks>()), gate_px_(gate_px) {}
CvReference::~CvReference() = default;
CvReference::CvReference(CvReference&&) noexcept = default;

void CvReference::track(std::span<Blob> blobs) {
  const bool first = tracks_->filters.empty();
  if (first) {
    for (const Blob& blob : blobs) tracks_->filters.push_back(filter_at(blob.centroid.v));
  }
  for (std::uint32_t i = 0; i < blobs.size(); ++i) blobs[i].track = first ? BlobTrackId{i} : BlobTrackId{};
  if (first) return;
  for (std::uint32_t i = 0; i < tracks_->filters.size(); ++i) {
    cv::KalmanFilter& filter = tracks_->filters[i];
    const cv::Mat& predicted = filter.predict();
    const Eigen::Vector2d centre_px(predicted.at<float>(0), predicted.at<float>(1));
    double nearest2 = gate_px_ * gate_px_;
    Blob* taken = nullptr;
    for (Blob& blob : blobs) {
      if (blob.track.names_something()) continue;
      const double distance2 = (blob.centroid.v - centre_px).squaredNorm();
      if (distance2 >= nearest2) continue;
      nearest2 = distance2;
      taken = &blob;
    }
    if (taken == nullptr) continue;
    taken->track = {i};
    tracks_->measured.at<float>(0) = static_cast<float>(taken->centroid.v.x());
    tracks_->measured.at<float>(1) = static_cast<float>(taken->centroid.v.y());
    filter.correct(tracks_->measured);
  }
}

}  // namespace mocap::paper_study
