#include "server/data/fetch/ahead.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <system_error>
#include <utility>

namespace windsplat::data::fetch {

namespace {

std::uint64_t bytes_of(const Extent& extent) { return extent.end - extent.begin; }

// Sets the bytes of a dataset, and counts them among those of all datasets.
void count(Fetcher::AheadLimits& all, std::uint64_t& bytes, std::uint64_t now) {
  all.unread_bytes += now - bytes;  // modulo 2^64
  bytes = now;
}

// The parts of a file that contain all extents, without overlap, in pieces of whole blocks. Extents
// outside of the file are left out, and all beyond Ahead::pieces_max.
std::vector<Extent> pieces_of(std::vector<Extent> extents, std::uint64_t file_bytes) {
  constexpr std::uint64_t block = SparseFile::block_bytes;
  std::sort(extents.begin(), extents.end(),
            [](const Extent& a, const Extent& b) { return a.begin < b.begin; });
  std::vector<Extent> out;
  for (const Extent& one : extents) {
    if (one.begin >= one.end || one.end > file_bytes) continue;
    const std::uint64_t end = std::min(file_bytes, (one.end + block - 1) / block * block);
    std::uint64_t begin = one.begin / block * block;
    if (!out.empty()) begin = std::max(begin, out.back().end);
    while (begin < end) {
      const bool grows =
          !out.empty() && out.back().end == begin && bytes_of(out.back()) < Ahead::piece_bytes;
      if (!grows && out.size() >= Ahead::pieces_max) return out;
      if (!grows) out.push_back({begin, begin});
      out.back().end = std::min(end, out.back().begin + Ahead::piece_bytes);
      begin = out.back().end;
    }
  }
  return out;
}

}  // namespace

Ahead::~Ahead() {
  forget();
  for (Worker& worker : workers_) {
    if (worker.thread.joinable()) worker.thread.join();
  }
}

void Ahead::expect(const std::string& url, const std::shared_ptr<SparseFile>& open,
                   const Expected& what) {
  const std::lock_guard lock(mutex_);
  if (is_off_) return;
  const bool is_known = std::any_of(openings_.begin(), openings_.end(),
                                    [&](const OpeningPtr& one) { return one->url == url; });
  if (open) {
    add_pieces(url, open, what);
  } else if (!is_known && openings_.size() < files_max) {
    openings_.push_back(std::make_shared<Opening>(Opening{url, what}));
  }
  start();
}

std::optional<Result<FetchedFile>> Ahead::take(const std::string& url, const Cancelled& cancelled) {
  constexpr std::chrono::milliseconds look_every{100};
  std::unique_lock lock(mutex_);
  const auto known = std::find_if(openings_.begin(), openings_.end(),
                                  [&](const OpeningPtr& one) { return one->url == url; });
  if (known == openings_.end()) return {};
  const OpeningPtr one = *known;
  while (one->is_under_way && !one->file) {
    changed_.wait_for(lock, look_every);
    if (cancelled && cancelled()) break;
  }
  openings_.remove(one);
  start();
  if (!one->file) return {};
  const bool is_known = *one->file || one->file->error().kind == ErrorKind::not_found;
  return is_known ? std::move(one->file) : std::nullopt;
}

void Ahead::note_read(const SparseFile& file, const Extent& extent) {
  const std::lock_guard lock(mutex_);
  auto& limits = fetcher_.ahead_limits();
  unread_.pieces.remove_if([&](const Piece& one) {
    const bool is_read =
        one.file.get() == &file && one.extent.begin >= extent.begin && one.extent.end <= extent.end;
    if (is_read) count(limits, unread_.bytes, unread_.bytes - bytes_of(one.extent));
    return is_read;
  });
  start();
}

void Ahead::drop_all() {
  ++round_;
  openings_.clear();
  pieces_.clear();
  unread_.pieces.clear();
  count(fetcher_.ahead_limits(), unread_.bytes, 0);
}

void Ahead::forget() {
  const std::lock_guard lock(mutex_);
  drop_all();
  is_off_ = false;
}

bool Ahead::give_way() {
  std::unique_lock lock(mutex_);
  drop_all();
  changed_.wait(lock, [this] { return working_ == 0; });
  return !std::exchange(is_off_, true);
}

bool Ahead::has_room(std::uint64_t bytes) const {
  const Fetcher::AheadLimits& limits = fetcher_.ahead_limits();
  if (limits.unread_bytes + bytes > limits.all_bytes_max) return false;
  bytes += unread_.bytes;
  for (const OpeningPtr& one : openings_) {
    if (one->is_under_way) bytes += one->bytes;
  }
  return bytes <= limits.bytes_max;
}

bool Ahead::may_open(const Opening& one) const {
  return !one.is_under_way && (one.what.in_parts || !unread_.is_large) &&
         has_room(fetcher_.ahead_limits().file_bytes_max);
}

void Ahead::start() {
  const auto waiting = std::count_if(openings_.begin(), openings_.end(),
                                     [&](const OpeningPtr& one) { return may_open(*one); });
  std::size_t wanted = static_cast<std::size_t>(waiting);
  if (has_room(piece_bytes)) wanted += pieces_.size();
  for (Worker& worker : workers_) {
    if (worker.works || wanted == 0 || !fetcher_.ahead_limits().begin()) continue;
    --wanted;
    if (worker.thread.joinable()) worker.thread.join();  // it has left the mutex, or is about to
    worker.works = true;
    ++working_;
    try {
      worker.thread = std::thread([this, &worker] { work(worker); });
    } catch (const std::system_error&) {  // the reader asks for everything itself
      worker.works = false;
      --working_;
      fetcher_.ahead_limits().end();
      return;
    }
  }
}

void Ahead::work(Worker& self) {
  std::unique_lock lock(mutex_);
  while (const Work task = next()) {
    lock.unlock();
    task();
    lock.lock();
  }
  self.works = false;
  --working_;
  fetcher_.ahead_limits().end();
  changed_.notify_all();
}

Ahead::Work Ahead::next() {
  while (!pieces_.empty() && has_room(piece_bytes)) {
    Piece piece = std::move(pieces_.front());
    pieces_.pop_front();
    if (!piece.file->is_present(piece.extent)) return fetching(std::move(piece));
  }
  const auto waiting = std::find_if(openings_.begin(), openings_.end(),
                                    [&](const OpeningPtr& one) { return may_open(*one); });
  return waiting == openings_.end() ? Work() : opening(*waiting);
}

Ahead::Work Ahead::fetching(Piece piece) {
  unread_.pieces.push_back(piece);
  count(fetcher_.ahead_limits(), unread_.bytes, unread_.bytes + bytes_of(piece.extent));
  return [this, piece = std::move(piece), round = round_.load()] {
    bool came = false;
    try {
      came = static_cast<bool>(fetcher_.fetch_part(
          piece.url, *piece.file, piece.extent.begin, bytes_of(piece.extent),
          [&] { return round_ != round; }, Purpose::ahead));
    } catch (const std::exception&) {  // the reader finds it missing
    }
    if (!came) note_read(*piece.file, piece.extent);
  };
}

Ahead::Work Ahead::opening(const OpeningPtr& one) {
  one->is_under_way = true;
  one->bytes = fetcher_.ahead_limits().file_bytes_max;
  return [this, one, round = round_.load()] {
    Result<FetchedFile> file = make_error(ErrorKind::cancelled, "it was not opened");
    try {
      const Fetch how = one->what.in_parts ? Fetch::parts : Fetch::whole;
      file = fetcher_.fetch(
          one->url, how, [&] { return round_ != round; }, Purpose::ahead);
    } catch (const std::exception&) {  // as above
    }
    const std::lock_guard lock(mutex_);
    if (round_ != round) return;
    finish(one, std::move(file));
    changed_.notify_all();
    start();
  };
}

void Ahead::finish(const OpeningPtr& one, Result<FetchedFile> file) {
  struct stat status {};
  one->bytes = 0;
  if (file && file->parts) {
    add_pieces(one->url, file->parts, one->what);
  } else if (file && ::fstat(file->file.number(), &status) == 0) {
    one->bytes = static_cast<std::uint64_t>(status.st_size);
  } else if (!file && file.error().kind == ErrorKind::too_large) {
    unread_.is_large = true;
  }
  one->file = std::move(file);
}

void Ahead::add_pieces(const std::string& url, const std::shared_ptr<SparseFile>& file,
                       const Expected& what) {
  const std::uint64_t bytes = file->bytes();
  std::vector<Extent> extents = what.extents;
  if (what.tail_bytes <= bytes) extents.push_back({bytes - what.tail_bytes, bytes});
  for (const Extent& one : pieces_of(std::move(extents), bytes)) {
    if (pieces_.size() >= pieces_max) return;
    if (!file->is_present(one)) pieces_.push_back({url, file, one});
  }
}

}  // namespace windsplat::data::fetch
