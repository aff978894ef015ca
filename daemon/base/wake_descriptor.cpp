#include "base/wake_descriptor.h"

#include <sys/eventfd.h>
#include <unistd.h>

namespace mocap {

WakeDescriptor::WakeDescriptor() : number_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

WakeDescriptor::~WakeDescriptor() {
  if (number_ >= 0) ::close(number_);
}

void WakeDescriptor::signal() noexcept {
  if (number_ >= 0) static_cast<void>(::eventfd_write(number_, 1));
}

void WakeDescriptor::clear() noexcept {
  eventfd_t count = 0;
  if (number_ >= 0) static_cast<void>(::eventfd_read(number_, &count));
}

}  // namespace mocap
