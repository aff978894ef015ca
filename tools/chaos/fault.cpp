#include "chaos/fault.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/expects.h"

namespace mocap::chaos {
namespace {

enum class Target { Camera, Subject, None };

struct KindFacts {
  FaultKind kind;
  const char* name;
  Target target;
  double least_s, most_s;            // duration
  double least_amount, most_amount;  // uniform
  const char* unit;
};

constexpr std::array kKinds{
    KindFacts{FaultKind::FramesLost, "frames-lost", Target::Camera, 0.05, 1.5, 0.1, 1.0, "of the frames"},
    KindFacts{FaultKind::FramesLate, "frames-late", Target::Camera, 0.05, 1.0, 0.002, 0.12, "s late"},
    KindFacts{FaultKind::FramesRepeated, "frames-repeated", Target::Camera, 0.05, 1.0, 0.1, 1.0, "of the frames"},
    KindFacts{FaultKind::FramesSwapped, "frames-swapped", Target::Camera, 0.05, 1.0, 0.1, 0.5, "of the frames"},
    KindFacts{FaultKind::ClockStep, "clock-step", Target::Camera, 0.1, 1.5, -3.0, 3.0, "s"},
    KindFacts{FaultKind::ClockDrift, "clock-drift", Target::Camera, 0.2, 2.0, -400.0, 400.0, "ppm"},
    KindFacts{FaultKind::ClockStill, "clock-still", Target::Camera, 0.05, 1.0, 0.0, 0.0, ""},
    KindFacts{FaultKind::Unplugged, "unplugged", Target::Camera, 0.05, 1.5, 0.0, 0.0, ""},
    KindFacts{FaultKind::Bumped, "bumped", Target::Camera, 0.2, 2.0, 0.1, 2.0, "degrees"},
    KindFacts{FaultKind::Dazzled, "dazzled", Target::Camera, 0.05, 1.5, 0.0, 0.0, ""},
    KindFacts{FaultKind::NoiseStorm, "noise-storm", Target::Camera, 0.05, 0.3, 100.0, 512.0, "blobs"},
    KindFacts{FaultKind::HostStalls, "host-stalls", Target::None, 0.01, 0.6, 0.0, 0.0, ""},
    KindFacts{FaultKind::PublisherStalls, "publisher-stalls", Target::None, 0.02, 1.0, 0.0, 0.0, ""},
    KindFacts{FaultKind::SubjectAway, "subject-away", Target::Subject, 0.1, 2.0, 0.0, 0.0, ""},
    KindFacts{FaultKind::SubjectLies, "subject-lies", Target::Subject, 1.5, 2.5, 0.0, 0.0, ""},
    KindFacts{FaultKind::SubjectsSwap, "subjects-swap", Target::None, 1.2, 2.0, 0.0, 0.0, ""},
    KindFacts{FaultKind::SubjectReset, "subject-reset", Target::Subject, 0.0, 0.0, 0.0, 0.0, ""},
    KindFacts{FaultKind::SubjectRemoved, "subject-removed", Target::Subject, 0.02, 1.5, 0.0, 0.0, ""},
    KindFacts{FaultKind::MessagesLost, "messages-lost", Target::None, 0.05, 1.5, 0.1, 1.0, "of the messages"},
    KindFacts{FaultKind::MessagesCut, "messages-cut", Target::None, 0.05, 1.0, 0.1, 1.0, "of the messages"},
    KindFacts{FaultKind::TakeRecorded, "take-recorded", Target::None, 0.05, 2.5, 0.0, 1.5, "s before"},
    KindFacts{FaultKind::TakeNext, "take-next", Target::None, 0.0, 0.0, 0.0, 0.0, ""},
    KindFacts{FaultKind::TakeCancelled, "take-cancelled", Target::None, 0.0, 0.0, 0.0, 0.0, ""},
    KindFacts{FaultKind::TakeCut, "take-cut", Target::None, 0.0, 0.0, 0.0, 1.0, "of the file is kept"},
    KindFacts{FaultKind::DiskFull, "disk-full", Target::None, 0.1, 1.5, 0.0, 30000.0, "bytes are free"},
    KindFacts{FaultKind::FolderGone, "folder-gone", Target::None, 0.0, 0.0, 0.0, 0.0, ""},
    KindFacts{FaultKind::Reload, "reload", Target::None, 0.0, 0.0, 0.0, 5.0, "(kind of the change)"},
};

const KindFacts& facts_of(FaultKind kind) {
  const auto found = std::ranges::find(kKinds, kind, &KindFacts::kind);
  MOCAP_EXPECTS(found != kKinds.end());
  return *found;
}

double between(scene::Random& random, double least, double most) { return least + (most - least) * random.uniform(); }

std::uint32_t below(scene::Random& random, std::uint32_t end) {
  return static_cast<std::uint32_t>(random.uniform() * end);
}

}  // namespace

Fault draw_fault(FaultKind of, scene::Random& random, const FaultBounds& bounds) {
  const KindFacts& kind = facts_of(of);
  Fault fault;
  fault.kind = of;
  fault.for_s = std::min(between(random, kind.least_s, kind.most_s), bounds.last_s - bounds.first_s);
  fault.from_s = between(random, bounds.first_s, bounds.last_s - fault.for_s);
  fault.amount = between(random, kind.least_amount, kind.most_amount);
  if (kind.target == Target::Camera) fault.target = below(random, bounds.cameras);
  if (kind.target == Target::Subject) fault.target = below(random, bounds.subjects);
  return fault;
}

std::vector<Fault> draw_faults(scene::Random& random, const FaultBounds& bounds) {
  std::vector<Fault> faults(below(random, bounds.most + 1));
  for (Fault& fault : faults) fault = draw_fault(kKinds[below(random, kKinds.size())].kind, random, bounds);
  std::ranges::stable_sort(faults, {}, &Fault::from_s);
  return faults;
}

const char* name_of(FaultKind kind) { return facts_of(kind).name; }

std::optional<FaultKind> fault_kind_named(std::string_view name) {
  const auto found = std::ranges::find(kKinds, name, [](const KindFacts& kind) { return std::string_view(kind.name); });
  return found == kKinds.end() ? std::nullopt : std::optional(found->kind);
}

std::vector<FaultKind> all_fault_kinds() {
  std::vector<FaultKind> kinds;
  for (const KindFacts& kind : kKinds) kinds.push_back(kind.kind);
  return kinds;
}

std::string to_text(const Fault& fault) {
  const KindFacts& kind = facts_of(fault.kind);
  std::string text = fmt::format("{:.3f} s for {:.3f} s: {}", fault.from_s, fault.for_s, kind.name);
  if (kind.target == Target::Camera) text += fmt::format(" camera {}", fault.target + 1);
  if (kind.target == Target::Subject) text += fmt::format(" subject {}", fault.target + 1);
  if (kind.least_amount < kind.most_amount) text += fmt::format(", {:.4g} {}", fault.amount, kind.unit);
  return text;
}

const Fault* active_fault(std::span<const Fault> faults, FaultKind kind, std::uint32_t target, double t_s) {
  const auto found = std::ranges::find_if(
      faults, [&](const Fault& fault) { return fault.kind == kind && fault.target == target && fault.is_active(t_s); });
  return found == faults.end() ? nullptr : &*found;
}

}  // namespace mocap::chaos
