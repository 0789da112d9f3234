#include "server/base/disk_error.hpp"

#include <cerrno>
#include <system_error>

namespace windsplat {

Error disk_error(int fault, const std::string& what) {
  const bool full = fault == ENOSPC || fault == EDQUOT || fault == EFBIG;
  return make_error(full ? ErrorKind::out_of_memory : ErrorKind::internal,
                    what + ": " + std::generic_category().message(fault));
}

}  // namespace windsplat
