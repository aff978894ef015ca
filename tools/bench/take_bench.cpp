#include "bench/take_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <fstream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "assemble.h"
#include "base/exit_codes.h"
#include "base/literal_text.h"
#include "bench/at_share.h"
#include "lib/retrack/retrack.h"
#include "module/control_server.h"
#include "settings/rig/rig_file.h"
#include "support/temporary_folder.h"
#include "wire/zmq_publisher.h"
#include "wire/zmq_subscriber.h"

namespace mocap::bench {
namespace {

namespace fs = std::filesystem;

constexpr Duration kWarmUp = std::chrono::seconds(6);  // T-pose, identification, the first steps
constexpr Duration kAnswerWithin = std::chrono::seconds(30);

// The time of publishing in each part of the run, in memory that is reserved before.
struct Spans {
  std::vector<double> idle_us, recording_us;
};

enum class Phase { Nothing, Idle, Recording };

// Forwards each call to the real publisher, and records the latencies.
class MeasuringPublisher : public Publisher {
 public:
  MeasuringPublisher(std::unique_ptr<Publisher> real, Spans& spans, TakeBenchFigures& figures,
                     const std::atomic<Phase>& phase)
      : real_(std::move(real)), spans_(spans), figures_(figures), phase_(phase) {}

  Status describe(const Description& description) override { return real_->describe(description); }
  Status report(const Health& health) override { return real_->report(health); }
  void serve() override { real_->serve(); }
  FeedHealth feed() const override { return real_->feed(); }

  Status publish(Snapshot& snapshot) override {
    const Status sent = real_->publish(snapshot);
    const Phase phase = phase_.load(std::memory_order_relaxed);
    if (!sent || phase == Phase::Nothing) return sent;
    std::vector<double>& spans = phase == Phase::Idle ? spans_.idle_us : spans_.recording_us;
    if (spans.size() < spans.capacity()) {
      spans.push_back(to_us(*snapshot.instants.sent_at - *snapshot.instants.detected_at));
    }
    if (phase == Phase::Recording) count(snapshot);
    return sent;
  }

 private:
  void count(const Snapshot& snapshot) {
    ++snapshots_;
    tracked_ += std::ranges::all_of(
        snapshot.labels, [](const SubjectLabels& subject) { return subject.phase == SubjectPhase::Tracking; });
    figures_.tracked_share = static_cast<double>(tracked_) / static_cast<double>(snapshots_);
  }

  std::unique_ptr<Publisher> real_;
  Spans& spans_;
  TakeBenchFigures& figures_;
  const std::atomic<Phase>& phase_;
  std::uint64_t snapshots_ = 0, tracked_ = 0;
};

// An operator in this process.
class Operator {
 public:
  // Waits for the answer. Fails with the answer's message, and with Timeout.
  Status order(TakeAction action) {
    std::unique_lock lock(mutex_);
    ControlRequest request;
    request.action = ControlAction::Take;
    request.take.action = action;
    requests_.push_back(std::move(request));
    answer_.reset();
    changed_.notify_all();
    if (!changed_.wait_for(lock, kAnswerWithin, [&] { return answer_.has_value(); })) {
      return Error{ErrorCode::Timeout, "the recorder of takes does not answer"};
    }
    if (answer_->code == ControlCode::Done) return {};
    return Error{ErrorCode::Io, answer_->message};
  }

  std::optional<ControlRequest> next(Duration patience) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, patience, [&] { return !requests_.empty(); });
    if (requests_.empty()) return std::nullopt;
    ControlRequest request = std::move(requests_.front());
    requests_.pop_front();
    return request;
  }

  void answer(const ControlAnswer& answer) {
    const std::lock_guard lock(mutex_);
    answer_ = answer;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<ControlRequest> requests_;
  std::optional<ControlAnswer> answer_;
};

class OperatorsServer : public ControlServer {
 public:
  explicit OperatorsServer(Operator& one) : operator_(one) {}
  std::optional<ControlRequest> next(Duration patience) override { return operator_.next(patience); }
  void answer(std::uint64_t, const ControlAnswer& answer) override { operator_.answer(answer); }

 private:
  Operator& operator_;
};

// Subscribers of the snapshots, served by one thread. Each counts the snapshots that it lost.
class Subscribers {
 public:
  static Result<std::unique_ptr<Subscribers>> open(const std::string& endpoint, int count) {
    auto all = std::make_unique<Subscribers>();
    for (int i = 0; i < count; ++i) {
      auto subscriber = wire::ZmqSubscriber::open({.endpoint = endpoint, .topics = {wire::kSnapshotTopic}});
      if (!subscriber) return subscriber.error();
      all->all_.push_back({*std::move(subscriber), std::nullopt});
    }
    all->thread_ = std::jthread([all = all.get()](const std::stop_token& stop) { all->run(stop); });
    return all;
  }

  std::uint64_t lost() const noexcept { return lost_.load(); }

 private:
  struct One {
    std::unique_ptr<wire::ZmqSubscriber> socket;
    std::optional<std::uint64_t> last;
  };

  void run(const std::stop_token& stop) {
    constexpr Duration kPause = std::chrono::milliseconds(2);
    while (!stop.stop_requested()) {
      for (One& one : all_) {
        for (auto message = one.socket->next(Duration::zero()); message; message = one.socket->next(Duration::zero())) {
          count(one, message->payload);
        }
      }
      std::this_thread::sleep_for(kPause);
    }
  }

  void count(One& one, const std::string& payload) {
    if (!message_.ParseFromString(payload)) return;
    const std::uint64_t sequence = message_.sequence();
    if (one.last && sequence > *one.last + 1) lost_ += sequence - *one.last - 1;
    one.last = sequence;
  }

  std::vector<One> all_;
  v1::Snapshot message_;
  std::atomic<std::uint64_t> lost_{0};
  std::jthread thread_;  // the last member, ends first
};

// A configuration in a file, because a take carries its configuration.
Result<settings::DaemonSettings> write_settings(const TakeBenchSettings& wanted, const simworld::SceneWorld& world,
                                                const fs::path& folder) {
  const std::string set = quoted_text(fs::absolute(wanted.scene.marker_set).string());
  std::string text = fmt::format(
      "[capture]\nrig = \"rig.toml\"\nrate_hz = {}\n[publish]\nendpoint = \"tcp://127.0.0.1:*\"\n[takes]\nfolder = "
      "{}\nmin_free_mb = 1\n",
      wanted.scene.rate_hz, quoted_text(folder.string()));
  for (const simworld::Performer& performer : world.performers()) {
    text += fmt::format("[[subject]]\nname = {}\nmarker_set = {}\n", quoted_text(performer.subject.name), set);
  }
  for (const CameraModel& camera : world.rig()) {
    text += fmt::format(
        "[[camera]]\nname = {}\ndriver = \"synthetic\"\nmarker_set = {}\nwidth_px = {}\nheight_px = {}\nrate_hz = {}\n",
        quoted_text(camera.name), set, camera.width_px, camera.height_px, wanted.scene.rate_hz);
  }
  if (const Status saved = settings::save_rig(folder / "rig.toml", world.rig(), {}); !saved) return saved.error();
  std::ofstream(folder / "mocapd.toml") << text;
  Result<settings::DaemonSettings, settings::Faults> loaded = settings::load_daemon_settings(folder / "mocapd.toml");
  if (!loaded) return Error{ErrorCode::InvalidArgument, settings::to_text(loaded.error())};
  return *std::move(loaded);
}

std::uint64_t dropped_in(const runtime::Pipeline& pipeline) {
  return pipeline.fusion_counters().passed_over_sets.read() + pipeline.fusion_counters().dropped_publish_full.read() +
         pipeline.publish_counters().passed_over.read();
}

std::uint64_t dropped_by_take(const runtime::Pipeline& pipeline) {
  std::uint64_t dropped = pipeline.fusion_counters().dropped_take_full.read();
  for (std::uint32_t i = 0; i < pipeline.camera_count(); ++i) {
    dropped += pipeline.camera_counters(CameraId{i}).dropped_take_full.read();
  }
  return dropped;
}

void wait(Duration span) {
  WakeSignal nobody_calls;
  nobody_calls.wait(nobody_calls.ticket(), span);
}

// Runs the pipeline without, with and again without a take.
Status run_phases(const TakeBenchSettings& wanted, runtime::Pipeline& pipeline, Operator& person,
                  const Subscribers& subscribers, std::atomic<Phase>& phase, TakeBenchFigures& figures) {
  wait(kWarmUp);
  phase = Phase::Idle;
  wait(from_s(wanted.idle_seconds / 2));
  phase = Phase::Nothing;
  const std::uint64_t lost_before = subscribers.lost() + dropped_in(pipeline);
  const std::uint64_t late_before = pipeline.fusion_counters().passed_over_sets.read();
  if (const Status started = person.order(TakeAction::Start); !started) return started;
  phase = Phase::Recording;
  wait(from_s(wanted.seconds));
  phase = Phase::Nothing;
  if (const Status stopped = person.order(TakeAction::Stop); !stopped) return stopped;
  figures.feed_lost = subscribers.lost() + dropped_in(pipeline) - lost_before;
  figures.feed_lost_by_fusion = pipeline.fusion_counters().passed_over_sets.read() - late_before;
  figures.take_lost = dropped_by_take(pipeline);
  phase = Phase::Idle;
  wait(from_s(wanted.idle_seconds / 2));
  phase = Phase::Nothing;
  return {};
}

Status judge_take(const fs::path& path, TakeBenchFigures& figures) {
  const Result<take::TakeReader> take = take::TakeReader::open(path);
  if (!take) return take.error();
  const double seconds = to_s(take->last_at() - take->first_at());
  figures.bytes_per_s = static_cast<double>(take->mcap().file().size()) / seconds;
  const auto known = take->info().others.find("quality_figures");
  if (known == take->info().others.end()) return Error{ErrorCode::InvalidArgument, "the take has no figures"};
  const auto quality = nlohmann::json::parse(known->second);
  figures.sets = quality.value("sets", std::uint64_t{0});
  figures.take_lost += quality.value("lost_sets", std::uint64_t{0}) + quality.value("lost_images", std::uint64_t{0});
  return {};
}

Status retrack_take(const fs::path& path, TakeBenchFigures& figures) {
  retrack::RetrackOrder order;
  order.take = path;
  order.out = path.parent_path() / "retracked.mcap";
  const Timestamp started = host_now();
  const auto report = retrack::retrack(order, [](const retrack::RetrackProgress&) { return true; });
  if (!report) return report.error();
  figures.retrack_speed = report->seconds / to_s(host_now() - started);
  figures.retrack_sets = report->recorded;
  figures.retrack_equal = report->equal;
  return {};
}

}  // namespace

Result<TakeBenchFigures> run_take_bench(const TakeBenchSettings& wanted) {
  std::optional<support::TemporaryFolder> temporary;
  const fs::path folder = wanted.folder.empty() ? temporary.emplace().path() : wanted.folder;
  Result<simworld::SceneWorld> world = make_bench_world(wanted.scene);
  if (!world) return world.error();
  const Result<settings::DaemonSettings> daemon = write_settings(wanted, *world, folder);
  if (!daemon) return daemon.error();
  SceneBlobs scene(*std::move(world), wanted.scene.rate_hz);
  Result<Assembly> assembly = assemble(*daemon);
  if (!assembly) return assembly.error();

  TakeBenchFigures figures;
  Spans spans;
  spans.idle_us.reserve(static_cast<std::size_t>(wanted.scene.rate_hz * (wanted.idle_seconds + 2.0)));
  spans.recording_us.reserve(static_cast<std::size_t>(wanted.scene.rate_hz * (wanted.seconds + 2.0)));
  std::atomic<Phase> phase{Phase::Nothing};
  runtime::PipelineParts& parts = assembly->parts;
  auto* real = dynamic_cast<wire::ZmqPublisher*>(parts.publisher.get());
  MOCAP_EXPECTS(real != nullptr);
  const std::string endpoint = real->endpoint();
  parts.publisher = std::make_unique<MeasuringPublisher>(std::move(parts.publisher), spans, figures, phase);
  Operator person;
  parts.control = std::make_unique<OperatorsServer>(person);
  for (std::uint32_t i = 0; i < parts.cameras.size(); ++i) {
    see_scene(parts.cameras[i], CameraId{i}, scene, assembly->shared->epoch);
  }
  auto subscribers = Subscribers::open(endpoint, wanted.subscribers);
  if (!subscribers) return subscribers.error();
  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(parts));
  const Status ran = run_phases(wanted, pipeline, person, **subscribers, phase, figures);
  pipeline.stop();
  subscribers->reset();
  if (!ran) return ran.error();

  figures.publish_p50_us = at_share(spans.recording_us, 0.50);
  figures.publish_p99_us = at_share(spans.recording_us, 0.99);
  figures.idle_publish_p50_us = at_share(spans.idle_us, 0.50);
  figures.idle_publish_p99_us = at_share(spans.idle_us, 0.99);
  const fs::path path = folder / "take_001.mcap";
  if (const Status judged = judge_take(path, figures); !judged) return judged.error();
  if (const Status retracked = retrack_take(path, figures); !retracked) return retracked.error();
  return figures;
}

cli::App* add_take_bench(cli::App& app, TakeBenchSettings& settings) {
  cli::App* take = app.add_subcommand(
      "take", "record a take while subscribers read the feed (losses, file size, latency), then track the take again");
  take->examples(
      "  mocap-bench take --seconds 60\n"
      "  mocap-bench take --seconds 600 --subscribers 20 --json");
  take->add_option("--cameras", settings.scene.cameras, "number of cameras, in a ring")
      ->check(cli::Range(2, 64))
      ->capture_default_str();
  take->add_option("--subjects", settings.scene.subjects, "walking people")
      ->check(cli::Range(1, 3))
      ->capture_default_str();
  take->add_option("--rate", settings.scene.rate_hz, "sets a second, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  take->add_option("--subscribers", settings.subscribers, "number of snapshot subscribers, in this process")
      ->check(cli::Range(0, 200))
      ->capture_default_str();
  take->add_option("--seconds", settings.seconds, "length of the take, s")
      ->check(cli::Range(1.0, 3600.0))
      ->capture_default_str();
  take->add_option("--idle-seconds", settings.idle_seconds, "measured time without a take, for comparison, s")
      ->check(cli::Range(1.0, 600.0))
      ->capture_default_str();
  take->add_option("--folder", settings.folder,
                   "an empty folder that keeps take, settings and the new take; default: a temporary one")
      ->type_name("DIR");
  return take;
}

int print_take_bench(const TakeBenchSettings& settings, bool json) {
  const Result<TakeBenchFigures> figures = run_take_bench(settings);
  if (!figures) {
    fmt::print(stderr, "mocap-bench: {}\n", figures.error().message);
    return kExitUnavailable;
  }
  const TakeBenchFigures& f = *figures;
  const double ratio = f.idle_publish_p99_us > 0.0 ? f.publish_p99_us / f.idle_publish_p99_us : 0.0;
  if (json) {
    const nlohmann::ordered_json object{{"sets", f.sets},
                                        {"feed_lost", f.feed_lost},
                                        {"feed_lost_by_fusion", f.feed_lost_by_fusion},
                                        {"take_lost", f.take_lost},
                                        {"bytes_per_s", f.bytes_per_s},
                                        {"publish_p50_us", f.publish_p50_us},
                                        {"publish_p99_us", f.publish_p99_us},
                                        {"idle_publish_p50_us", f.idle_publish_p50_us},
                                        {"idle_publish_p99_us", f.idle_publish_p99_us},
                                        {"ratio_publish_p99", ratio},
                                        {"tracked_share", f.tracked_share},
                                        {"retrack_speed", f.retrack_speed},
                                        {"retrack_sets", f.retrack_sets},
                                        {"retrack_equal", f.retrack_equal}};
    fmt::print("{}\n", object.dump());
    return kExitOk;
  }
  fmt::print(
      "sets           {}, lost by the feed {} ({} of them before fusion), by the take {}\nfile           {:.2f} MB/s\n",
      f.sets, f.feed_lost, f.feed_lost_by_fusion, f.take_lost, 1e-6 * f.bytes_per_s);
  fmt::print("publish        p50 {:.0f} us, p99 {:.0f} us; not recording {:.0f} us, {:.0f} us; p99 ratio {:.2f}\n",
             f.publish_p50_us, f.publish_p99_us, f.idle_publish_p50_us, f.idle_publish_p99_us, ratio);
  fmt::print("tracked        {:.2f} % of the snapshots have every subject\n", 100.0 * f.tracked_share);
  fmt::print("tracked again  {:.1f} times real time; {} of {} snapshots equal\n", f.retrack_speed, f.retrack_equal,
             f.retrack_sets);
  return kExitOk;
}

}  // namespace mocap::bench
