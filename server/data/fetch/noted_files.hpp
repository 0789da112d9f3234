// What was noticed of files on hosts while the program runs, within bounds.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <set>
#include <string>

namespace windsplat::data::fetch {

// Thread-safe. Files by the key of Fetcher; beyond 4096 of a kind, those noted before are
// forgotten.
class NotedFiles {
 public:
  // Files whose parts do not fit together, for a minute.
  [[nodiscard]] bool is_unfit(const std::string& key);
  void note_unfit(const std::string& key);

  // Files that were given as a whole where parts were wanted. Datasets know them by their bytes, so
  // that they must be fetched as a whole again when they are no longer in the cache.
  [[nodiscard]] bool was_whole(const std::string& key);
  void note_whole(const std::string& key);
  void forget_whole(const std::string& key);

  // States (SparseFile::state()) of the files in parts that were read to their end.
  [[nodiscard]] bool is_kept(const std::string& state);
  // False: it is known.
  bool note_kept(const std::string& state);

 private:
  using Clock = std::chrono::steady_clock;
  std::mutex mutex_;  // guards the members below
  std::map<std::string, Clock::time_point> unfit_;
  std::set<std::string> whole_;
  std::set<std::string> kept_;
};

}  // namespace windsplat::data::fetch
