// The files of a dataset, and the only way to open them. User input -> Location -> Files ->
// InputFile.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/files/stamp.hpp"

namespace windsplat::data {

// The location of a dataset, links resolved.
struct Location {
  enum class Kind {
    file,    // one file and the companions that its format refers to
    series,  // the files that a pattern matches, in natural order (f2 before f10)
    folder,  // a folder that is one dataset, with all its contents
  };
  struct Member {
    std::string name;  // relative name, as used by readers and in messages
    std::string path;  // absolute
  };
  Kind kind = Kind::file;
  std::string folder;           // absolute; of Kind::folder the dataset itself
  std::vector<Member> members;  // of a file one, of a folder none
  bool companions = false;      // other files below `folder` may be opened too
  std::string inside;           // a group within the file or files ("a/b"), for formats with groups
  std::string stem;             // what a dataset of these is called: no folder, no extension
  std::string pattern;          // of a series, absolute, or below `root` if that is not empty
  std::string root;
};

// A path of a file or folder, or a pattern whose last part has * ? or [...]; of files that hold
// groups also "path#/group". Whether a file may
// have companions follows from the ending of its name (those of formats whose header refers to
// other files). Errors: not_found; bad_data for URLs and what is neither file nor folder.
Result<Location> locate(const std::string& path_or_pattern);

// The same for an untrusted path below the folder `root`: "..", absolute paths and links cannot
// leave it, and absolute links are not followed. Reads names only. Errors: invalid (refused, or
// neither file nor folder), not_found; they contain the path as given, not the root.
Result<Location> locate_beneath(const std::string& root, const std::string& path_or_pattern);

// Matches the pattern of a series again. Errors: those of the function that located it.
Result<Location> locate_again(const Location& series);

class Files {
 public:
  virtual ~Files() = default;
  [[nodiscard]] virtual const Location& location() const = 0;
  // `name`: a member's, or that of a companion, relative to the folder, parts between '/'; never
  // above the folder. Errors: not_found, bad_data.
  virtual Result<std::shared_ptr<const InputFile>> open(const std::string& name) = 0;
  // Entries of a folder below (empty: the folder itself), sorted; folders end in '/'. Errors:
  // not_found, bad_data.
  virtual Result<std::vector<std::string>> list(const std::string& folder) = 0;
  // Whether there is such a file or folder.
  virtual bool exists(const std::string& name) = 0;
  // The companions that were opened so far, the first few hundred of them.
  [[nodiscard]] virtual std::vector<Companion> companions() const { return {}; }
  // Bytes of all files that were opened until stop_counting(), which forgets their names.
  [[nodiscard]] std::uint64_t opened_bytes() const { return opened_bytes_; }
  void stop_counting() {
    counts_ = false;
    opened_.clear();
  }

 protected:
  void count_opened(const std::string& name, std::uint64_t bytes) {
    if (counts_ && opened_.insert(name).second) opened_bytes_ += bytes;
  }

 private:
  bool counts_ = true;
  std::set<std::string> opened_;
  std::uint64_t opened_bytes_ = 0;
};

// Opens what the location allows, by way of openat2 with RESOLVE_BENEATH for companions.
std::shared_ptr<Files> direct_files(Location location);

}  // namespace windsplat::data
