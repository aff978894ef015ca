#include "take/recordings/disk_reason.h"

#include <cerrno>
#include <cstring>

namespace mocap::take {
namespace {

const char* advice_for(int error_number) {
  switch (error_number) {
    case ENOSPC:
    case EDQUOT: return "; free space on its disk";
    case EACCES:
    case EPERM:
    case EROFS: return "; make the file and its folder writable for this user";
    case ENAMETOOLONG: return "; choose a shorter name";
    default: return "";
  }
}

}  // namespace

std::string disk_reason(int error_number) {
  return std::string(std::strerror(error_number)) + advice_for(error_number);  // NOLINT(concurrency-mt-unsafe)
}

}  // namespace mocap::take
