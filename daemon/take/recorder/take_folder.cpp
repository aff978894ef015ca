#include "take/recorder/take_folder.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "take/take_info.h"

namespace mocap::take {
namespace {

constexpr double kMegabyte = 1e6;

}  // namespace

Status TakeFolder::check_order(const TakeOrder& order) const {
  if (!order.name.empty()) {
    if (const Status valid = check_name(order.name, "the name of the take"); !valid) return valid;
    if (has_take(settings_.folder, order.name)) {
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("there is a take '{}' in {} already; the next free name is '{}'", order.name,
                               settings_.folder.string(), free_name(settings_.folder, order.name))};
    }
  }
  if (!order.slate.empty()) {
    if (const Status valid = check_name(order.slate, "the slate"); !valid) return valid;
  }
  TakeInfo noted;
  noted.notes = plain_text(order.text);
  if (const Status valid = check(noted); !valid) return valid;
  if (order.before > settings_.before) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("before is {:.1f} s, expected at most [takes] before_s = {:.1f}", to_s(order.before),
                             to_s(settings_.before))};
  }
  return {};
}

Status TakeFolder::prepare() const {
  std::error_code error;
  std::filesystem::create_directories(settings_.folder, error);
  if (error) {
    return Error{ErrorCode::Io,
                 fmt::format("[takes] folder '{}' cannot be made: {}", settings_.folder.string(), error.message())};
  }
  return check_space();
}

Status TakeFolder::check_space() const {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(settings_.folder, error);
  if (error) {
    return Error{ErrorCode::Io, fmt::format("[takes] folder '{}': {}", settings_.folder.string(), error.message())};
  }
  if (space.available >= settings_.min_free_mb * 1'000'000) return {};
  return Error{
      ErrorCode::Io,
      fmt::format("'{}' has {:.0f} MB free, less than [takes] min_free_mb = {}; free some space",
                  settings_.folder.string(), static_cast<double>(space.available) / kMegabyte, settings_.min_free_mb)};
}

TakeName TakeFolder::name_for(const TakeOrder& order, const std::string& slate, Duration utc) const {
  if (!order.name.empty()) return {order.name, 0};
  return next_name(settings_.folder, settings_.name, slate, utc);
}

TakeOrder TakeFolder::with_shot(TakeOrder order, const Shot& shot) const {
  order.name = has_take(settings_.folder, shot.name) ? free_name(settings_.folder, shot.name) : shot.name;
  if (order.slate.empty()) order.slate = shot.slate;
  if (order.text.empty()) order.text = shot.notes;
  if (order.length == Duration::zero()) order.length = shot.length;
  return order;
}

Status check_file(const std::string& path) {
  struct stat now {};
  if (::stat(path.c_str(), &now) == 0) return {};
  return Error{ErrorCode::Io, fmt::format("'{}' is gone ({}): its folder or its file was removed", path,
                                          std::strerror(errno))};  // NOLINT(concurrency-mt-unsafe)
}

}  // namespace mocap::take
