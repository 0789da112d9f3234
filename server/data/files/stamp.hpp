// Identifies the state of a file, to detect changes.
#pragma once

#include <sys/stat.h>

#include <string>

namespace windsplat::data {

struct FileStamp {
  std::string text;      // identity, size and modification time of the file; "gone" if absent
  double changed_s = 0;  // that time, since the epoch
  bool operator==(const FileStamp& other) const { return text == other.text; }
};

FileStamp stamp_of(const struct stat& status);
FileStamp stamp_of(const std::string& path);

// A file besides the members of a location that was opened for a dataset, as it was then.
struct Companion {
  std::string path;  // absolute
  FileStamp stamp;
};

}  // namespace windsplat::data
