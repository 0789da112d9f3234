// What a reader says that it will read soon, fetched by several requests at a time.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/fetch/fetcher.hpp"
#include "server/data/fetch/sparse_file.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::fetch {

// Of the files of one dataset. Everything expected is a hint: what exceeds the bounds is left to
// the reader, and a failure is found again by the reader, if there is one. At most
// AheadLimits::bytes_max are fetched and not read, so that a small cache holds what was fetched
// until it is read.
class Ahead {
 public:
  static constexpr std::size_t requests_max = 8;
  static constexpr std::size_t files_max = 64;     // that are opened ahead
  static constexpr std::size_t pieces_max = 4096;  // that wait
  static constexpr std::uint64_t piece_bytes = 16 * SparseFile::block_bytes;  // of a request

  explicit Ahead(Fetcher& fetcher) : fetcher_(fetcher) {}
  ~Ahead();  // cancels the requests and waits for their end
  Ahead(const Ahead&) = delete;
  Ahead& operator=(const Ahead&) = delete;

  // `open`: the file, if it is open in parts. Null: it is opened, then its extents are fetched.
  void expect(const std::string& url, const std::shared_ptr<SparseFile>& open,
              const Expected& what);
  // The file, if it was opened ahead or is not there; waits if that is under way. Empty: the caller
  // has to open it.
  std::optional<Result<FetchedFile>> take(const std::string& url, const Cancelled& cancelled);
  // These bytes were read, or are not asked for again.
  void note_read(const SparseFile& file, const Extent& extent);
  // Nothing that was expected is wanted any more; ends its requests.
  void forget();
  // The same, and waits for the end of the requests; nothing more is fetched ahead until forget().
  // False: it was so already.
  bool give_way();

 private:
  struct Opening {
    std::string url;
    Expected what;
    std::uint64_t bytes = 0;    // that it takes of the window, once it is under way
    bool is_under_way = false;  // or over
    std::optional<Result<FetchedFile>> file = {};
  };
  struct Piece {
    std::string url;
    std::shared_ptr<SparseFile> file;
    Extent extent;
  };
  struct Unread {
    std::list<Piece> pieces;  // under way, or fetched and not read
    std::uint64_t bytes = 0;  // of them
    bool is_large = false;    // whole files are too large, and left to the reader from now on
  };
  struct Worker {
    std::thread thread;
    bool works = false;
  };
  using OpeningPtr = std::shared_ptr<Opening>;
  using Work = std::function<void()>;

  void work(Worker& self);
  // The functions below need the mutex to be held.
  void start();
  void drop_all();
  Work next();
  Work fetching(Piece piece);
  Work opening(const OpeningPtr& one);
  void add_pieces(const std::string& url, const std::shared_ptr<SparseFile>& file,
                  const Expected& what);
  void finish(const OpeningPtr& one, Result<FetchedFile> file);
  [[nodiscard]] bool has_room(std::uint64_t bytes) const;
  [[nodiscard]] bool may_open(const Opening& one) const;

  Fetcher& fetcher_;
  std::atomic<std::uint64_t> round_ = 0;  // requests of earlier rounds are not wanted any more
  std::mutex mutex_;                      // guards the members below
  std::condition_variable changed_;
  bool is_off_ = false;
  std::size_t working_ = 0;
  std::array<Worker, requests_max> workers_;
  std::list<OpeningPtr> openings_;  // waiting, under way, or not taken yet
  std::deque<Piece> pieces_;        // waiting
  Unread unread_;
};

}  // namespace windsplat::data::fetch
