#include "web/metrics/metric_table.h"

namespace mocap::web {
namespace {

using enum MetricKind;

constexpr Metric kHealth[] = {
    {"set_rate_hz", "mocap_set_rate_hertz", Gauge, 1.0, "Frame sets per second, over the last second."},
    {"sets", "mocap_sets_total", Counter, 1.0, "Frame sets."},
    {"complete_sets", "mocap_complete_sets_total", Counter, 1.0, "Frame sets with an image of every camera."},
    {"passed_over_sets", "mocap_passed_over_sets_total", Counter, 1.0,
     "Sets that the fusion skipped because a newer set was waiting."},
    {"dropped_snapshots", "mocap_dropped_snapshots_total", Counter, 1.0,
     "Snapshots dropped because the queue to the publisher was full."},
    {"passed_over_snapshots", "mocap_passed_over_snapshots_total", Counter, 1.0,
     "Snapshots that the publisher skipped because a newer one was waiting."},
    {"sent_snapshots", "mocap_sent_snapshots_total", Counter, 1.0, "Snapshots passed to the transport."},
};

constexpr Metric kCamera[] = {
    {"rate_hz", "mocap_camera_rate_hertz", Gauge, 1.0, "Images per second, over the last second."},
    {"frames", "mocap_camera_frames_total", Counter, 1.0, "Images received."},
    {"missing_frames", "mocap_camera_missing_frames_total", Counter, 1.0,
     "Images missing in the camera's frame numbers."},
    {"failed_frames", "mocap_camera_failed_frames_total", Counter, 1.0, "Images that arrived incomplete."},
    {"dropped_queue_full", "mocap_camera_dropped_frames_total", Counter, 1.0,
     "Images dropped because the queue to the fusion was full."},
    {"dropped_blobs", "mocap_camera_dropped_blobs_total", Counter, 1.0, "Blobs beyond the limit for one image."},
    {"reopened", "mocap_camera_reopened_total", Counter, 1.0, "Times that the camera was lost and opened again."},
    {"underruns", "mocap_camera_underruns_total", Counter, 1.0, "Images that arrived while no buffer was free."},
    {"resent_packets", "mocap_camera_resent_packets_total", Counter, 1.0,
     "Packets that were lost and arrived after a resend request."},
    {"missing_packets", "mocap_camera_missing_packets_total", Counter, 1.0, "Packets that never arrived."},
    {"blobs", "mocap_camera_blobs_total", Counter, 1.0, "Detected blobs."},
    {"blobs_too_small", "mocap_camera_blobs_too_small_total", Counter, 1.0, "Blobs rejected: too small."},
    {"blobs_too_large", "mocap_camera_blobs_too_large_total", Counter, 1.0, "Blobs rejected: too large."},
    {"blobs_not_round", "mocap_camera_blobs_not_round_total", Counter, 1.0, "Blobs rejected: not round."},
    {"blobs_too_dim", "mocap_camera_blobs_too_dim_total", Counter, 1.0, "Blobs rejected: too dim."},
    {"rows_given_up", "mocap_camera_rows_given_up_total", Counter, 1.0,
     "Image rows skipped because they have too many bright runs."},
    {"threshold_grey", "mocap_camera_threshold_grey", Gauge, 1.0, "Detection threshold, grey value from 0 to 255."},
    {"noise_grey", "mocap_camera_noise_grey", Gauge, 1.0, "Standard deviation of the dark pixels, grey value."},
    {"background_grey", "mocap_camera_background_grey", Gauge, 1.0, "Mean of the dark pixels, grey value."},
    {"brightest_grey", "mocap_camera_brightest_grey", Gauge, 1.0,
     "Brightest unmasked pixel of an image without blobs, grey value."},
    {"synchronised", "mocap_camera_synchronised", Gauge, 1.0,
     "1: the camera exposes together with most other cameras."},
    {"offset_us", "mocap_camera_exposure_offset_seconds", Gauge, 1e-6,
     "Delay of the camera's exposures after the mean of the synchronised cameras."},
    {"drift_us_s", "mocap_camera_exposure_drift_ratio", Gauge, 1e-6, "Rate of change of the exposure offset, s per s."},
    {"jitter_us", "mocap_camera_exposure_jitter_seconds", Gauge, 1e-6, "Standard deviation of the exposure offset."},
    {"repeated_frames", "mocap_camera_repeated_frames_total", Counter, 1.0,
     "Images that arrived a second time and were dropped."},
    {"clock_leaps", "mocap_camera_clock_leaps_total", Counter, 1.0,
     "Times that the camera's clock wrapped, jumped, ran back or stopped."},
    {"clock_uncertainty_us", "mocap_camera_clock_uncertainty_seconds", Gauge, 1e-6,
     "Standard deviation of the exposure times on the host's clock; 0: unknown."},
    {"bumped", "mocap_camera_bumped", Gauge, 1.0, "1: the camera's pose differs from the rig."},
    {"rig_off_px", "mocap_camera_rig_error_pixels", Gauge, 1.0,
     "Reprojection error of the markers of the other cameras."},
    {"rig_turned_rad", "mocap_camera_rig_rotation_radians", Gauge, 1.0, "Rotation of the camera against the rig."},
    {"rig_moved_m", "mocap_camera_rig_translation_meters", Gauge, 1.0, "Translation of the camera against the rig."},
    {"chunk_times", "mocap_camera_chunk_times", Gauge, 1.0, "1: the camera writes the exposure time into the image."},
    {"fused_blobs", "mocap_camera_fused_blobs_total", Counter, 1.0, "Blobs in the fused sets."},
    {"marker_blobs", "mocap_camera_marker_blobs_total", Counter, 1.0, "Blobs that are views of a 3D marker."},
    {"marker_share", "mocap_camera_marker_ratio", Gauge, 1.0,
     "Share of the camera's blobs that are views of a 3D marker, over the last second."},
};

constexpr Metric kFeed[] = {
    {"listeners", "mocap_feed_subscribers", Gauge, 1.0, "Current connections of subscribers."},
    {"connections", "mocap_feed_connections_total", Counter, 1.0, "Connections whose handshake succeeded."},
    {"disconnections", "mocap_feed_disconnections_total", Counter, 1.0, "Connections that ended."},
    {"failed_handshakes", "mocap_feed_failed_handshakes_total", Counter, 1.0,
     "Connections that ended before their handshake."},
    {"refused_clients", "mocap_feed_refused_clients_total", Counter, 1.0,
     "Attempts by clients whose key is not allowed."},
    {"cut_off", "mocap_feed_cut_off_total", Counter, 1.0, "Connections that the daemon closed."},
    {"subscriptions", "mocap_feed_subscriptions", Gauge, 1.0, "Current subscriptions."},
    {"failed_accepts", "mocap_feed_failed_accepts_total", Counter, 1.0,
     "Connections that could not be accepted because no file descriptor was free."},
    {"behind", "mocap_feed_subscribers_behind", Gauge, 1.0, "Current connections with over 64 KiB of unsent data."},
};

constexpr Metric kTake[] = {
    {"seconds", "mocap_take_length_seconds", Gauge, 1.0, "Length of the take that is recorded, or of the last one."},
    {"size_bytes", "mocap_take_size_bytes", Gauge, 1.0, "Size of the take that is recorded, or of the last one."},
    {"sets", "mocap_take_sets", Gauge, 1.0, "Snapshots in the take."},
    {"lost_sets", "mocap_take_lost_sets", Gauge, 1.0, "Sets that the take lacks."},
    {"lost_images", "mocap_take_lost_images", Gauge, 1.0, "Images whose blobs the take lacks."},
    {"takes", "mocap_takes_total", Counter, 1.0, "Takes since the start of the daemon."},
};

constexpr Metric kRecording[] = {
    {"size_bytes", "mocap_recording_size_bytes", Gauge, 1.0,
     "Size of the file, with the data that are not written yet."},
    {"records", "mocap_recording_records", Gauge, 1.0, "Snapshots or images in the file."},
};

constexpr Metric kLatency[] = {
    {"count", "mocap_latency_snapshots", Gauge, 1.0, "Snapshots in the latency figures, over the last second."},
    {"p50_ns", "mocap_latency_median_seconds", Gauge, 1e-9, "Median latency of the stage, over the last second."},
    {"p99_ns", "mocap_latency_percentile99_seconds", Gauge, 1e-9,
     "99th percentile of the latency of the stage, over the last second."},
    {"max_ns", "mocap_latency_max_seconds", Gauge, 1e-9, "Largest latency of the stage, over the last second."},
};

}  // namespace

std::span<const Metric> health_metrics() { return kHealth; }
std::span<const Metric> camera_metrics() { return kCamera; }
std::span<const Metric> feed_metrics() { return kFeed; }
std::span<const Metric> take_metrics() { return kTake; }
std::span<const Metric> recording_metrics() { return kRecording; }
std::span<const Metric> latency_metrics() { return kLatency; }

}  // namespace mocap::web
