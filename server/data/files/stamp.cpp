// Formats the result of stat().
#include "server/data/files/stamp.hpp"

namespace windsplat::data {

FileStamp stamp_of(const struct stat& status) {
  FileStamp out;
  out.text = std::to_string(status.st_dev) + ':' + std::to_string(status.st_ino) + ':' +
             std::to_string(status.st_size) + ':' + std::to_string(status.st_mtim.tv_sec) + '.' +
             std::to_string(status.st_mtim.tv_nsec);
  out.changed_s = static_cast<double>(status.st_mtim.tv_sec) +
                  1e-9 * static_cast<double>(status.st_mtim.tv_nsec);
  return out;
}

FileStamp stamp_of(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return {"gone", 0};
  return stamp_of(status);
}

}  // namespace windsplat::data
