// Identifies the state of a file, to detect changes.
#pragma once

#include <sys/stat.h>

#include <string>

namespace windsplat::data {

struct FileStamp {
  std::string text;      // identity, size and modification time of the file; "gone" if it does not
                         // exist
  double changed_s = 0;  // time of modification, since the epoch
  bool operator==(const FileStamp& other) const { return text == other.text; }
};

FileStamp stamp_of(const struct stat& status);
FileStamp stamp_of(const std::string& path);

// A file opened for a dataset in addition to the members of its location, with its state at that
// time.
struct Companion {
  std::string path;  // absolute
  FileStamp stamp;
};

}  // namespace windsplat::data
