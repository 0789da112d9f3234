// The files of a dataset. All files are opened here: user input -> Location -> Files -> InputFile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/files/selection.hpp"
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
  std::string folder;           // absolute; for Kind::folder the dataset itself
  std::vector<Member> members;  // one for a file, none for a folder
  bool companions = false;      // other files below `folder` may be opened too
  // Fetched from a host: `folder` and the paths of members are URLs without a final '/'.
  bool fetched = false;
  // Fetched from an OPeNDAP service, of which the member is a dataset. Its files are answers, named
  // NAME.dds, NAME.das and NAME.dods?CONSTRAINT.
  bool service = false;
  std::string inside;   // a group within the file or files ("a/b"), for formats with groups
  std::string stem;     // name of the dataset: without folder and extension
  std::string pattern;  // for a series: absolute, or below `root` if that is not empty
  std::string root;
  Selection selection;  // entries of dimensions that were chosen
  std::string list;     // JSON text that lists the files below `folder` (formats/list); no members

  // Id of the listed dataset of which it shows other entries; empty: `stem` is its own.
  std::string listed_id;

  // The dataset's id as wanted: "gcm", with a selection "gcm,number=3", which is cut where views
  // could not name it.
  [[nodiscard]] std::string wanted_id() const {
    constexpr std::size_t bytes_max = 240;
    const std::string& base = listed_id.empty() ? stem : listed_id;
    return selection.empty() ? base : (base + ',' + selection_text(selection)).substr(0, bytes_max);
  }
};

// Locates a path of a file or folder, or a pattern whose last part has * ? or [...]; for files with
// groups also "path#/group". Either may be followed by a selection, "path?number=3", unless a file
// has this name. The ending of a file name determines whether the file may have
// companions. For a URL the same as locate_url(). Errors: not_found; bad_data for special files;
// invalid for a malformed selection.
Result<Location> locate(const std::string& path_or_pattern);

// The same for an untrusted path below the folder `root`: "..", absolute paths and links cannot
// leave it, and absolute links are not followed. Reads names only. Errors: invalid (refused, or a
// special file), not_found; messages contain the path as given, not the root.
Result<Location> locate_beneath(const std::string& root, const std::string& path_or_pattern);

// Matches the pattern of a series again. Errors: those of the function that located it.
Result<Location> locate_again(const Location& series);

// Bytes [begin, end) of a file.
struct Extent {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
};

// What a reader will read soon of a file.
struct Expected {
  std::string name;
  bool in_parts = false;             // by Files::open_parts()
  std::uint64_t tail_bytes = 0;      // its last bytes
  std::vector<Extent> extents = {};  // once it is open in parts
};

// Files that a dataset may have open besides its members.
inline constexpr std::size_t open_besides_members_max = 256;

class Files {
 public:
  virtual ~Files() = default;
  [[nodiscard]] virtual const Location& location() const = 0;
  // `name`: a member, or a companion relative to the folder, with '/' as separator; never above the
  // folder. Errors: not_found, bad_data.
  virtual Result<std::shared_ptr<const InputFile>> open(const std::string& name) = 0;
  // The same; only what is read of a fetched file is fetched, if its host sends parts.
  virtual Result<std::shared_ptr<const InputFile>> open_parts(const std::string& name) {
    return open(name);
  }
  // A hint to fetch it before it is asked for, while other files are read; has no errors.
  virtual void expect(const Expected& /*what*/) {}
  // What was expected and not read is not wanted any more.
  virtual void forget_expected() {}
  // Entries of the folder or, unless empty, of `below` in it, sorted; folders end in '/'. Errors:
  // not_found, bad_data.
  virtual Result<std::vector<std::string>> list(const std::string& folder) = 0;
  // Whether a file or folder with this name exists.
  virtual bool exists(const std::string& name) = 0;
  // Fetches bytes of an open file that is here in parts, by the number of its parts
  // (InputFile::parts()); the result contains them, clipped to the file. Errors: those of open();
  // they are also a fault, which every further call returns until take_fault().
  virtual Result<Extent> fetch_part(std::uint64_t /*number*/, std::uint64_t /*offset*/,
                                    std::uint64_t /*count*/) {
    return make_error(ErrorKind::not_found, "no file is here in parts");
  }
  // No more bytes of that file will be fetched.
  virtual void close_parts(std::uint64_t /*number*/) {}
  // The first error of fetch_part(), or other than not_found of exists(), since the last call:
  // whether the file exists is then unknown.
  [[nodiscard]] virtual std::optional<Error> take_fault() { return {}; }
  // Whether fetch_part() met bytes that do not fit together; when it is opened again, the file is
  // fetched as a whole.
  [[nodiscard]] virtual bool is_unfit_for_parts() const { return false; }
  // The companions opened so far, at most a few hundred.
  [[nodiscard]] virtual std::vector<Companion> companions() const { return {}; }
  // Total size of all files opened until stop_counting(), which also forgets their names.
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

// Opens files within a location; companions through openat2 with RESOLVE_BENEATH. Of a location
// that is fetched it opens nothing: the error says so.
std::shared_ptr<Files> direct_files(Location location);

}  // namespace windsplat::data
