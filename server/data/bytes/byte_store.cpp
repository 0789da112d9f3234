// Maps offsets of the whole run to pieces and their files.
#include "server/data/bytes/byte_store.hpp"

#include <algorithm>
#include <cstring>
#include <list>
#include <utility>

#include "server/base/check.hpp"

namespace windsplat::data::bytes {

namespace {

constexpr std::size_t open_max = 4;

class FileStore final : public ByteStore {
 public:
  FileStore(std::shared_ptr<const InputFile> file, std::uint64_t skip)
      : file_(std::move(file)), skip_(skip) {}
  Result<void> read(std::uint64_t offset, unsigned char* out, std::size_t count) override {
    return file_->read(skip_ + offset, out, count);
  }
  [[nodiscard]] Result<void> check_unchanged() const override { return file_->check_unchanged(); }

 private:
  std::shared_ptr<const InputFile> file_;
  std::uint64_t skip_;
};

class JoinedStore final : public ByteStore {
 public:
  explicit JoinedStore(std::vector<Piece> pieces) : pieces_(std::move(pieces)) {
    begins_.reserve(pieces_.size() + 1);
    begins_.push_back(0);
    for (const Piece& piece : pieces_) begins_.push_back(begins_.back() + piece.bytes);
  }

  Result<void> read(std::uint64_t offset, unsigned char* out, std::size_t count) override {
    WINDSPLAT_CHECK(offset <= begins_.back() && count <= begins_.back() - offset);
    auto at = static_cast<std::size_t>(std::upper_bound(begins_.begin(), begins_.end(), offset) -
                                       begins_.begin() - 1);
    while (count > 0) {
      const std::uint64_t here = std::min<std::uint64_t>(count, begins_[at + 1] - offset);
      if (!pieces_[at].open) {
        std::memset(out, 0xff, here);
      } else if (here > 0) {
        auto store = opened(at);
        if (!store) return store.error();
        if (auto done = (*store)->read(offset - begins_[at], out, here); !done) return done;
      }
      out += here;
      offset += here;
      count -= here;
      ++at;
    }
    return {};
  }

  [[nodiscard]] Result<void> check_unchanged() const override {
    for (const auto& [index, store] : open_) {
      if (auto fine = store->check_unchanged(); !fine) return fine;
    }
    return {};
  }

 private:
  // The store of a piece; closes the least recently used one if too many are open.
  Result<std::shared_ptr<ByteStore>> opened(std::size_t index) {
    const auto at = std::find_if(open_.begin(), open_.end(),
                                 [index](const auto& known) { return known.first == index; });
    if (at != open_.end()) {
      open_.splice(open_.begin(), open_, at);
      return open_.front().second;
    }
    auto store = pieces_[index].open();
    if (!store) return store.error();
    if (open_.size() >= open_max) open_.pop_back();
    open_.emplace_front(index, *store);
    return *store;
  }

  std::vector<Piece> pieces_;
  std::vector<std::uint64_t> begins_;
  std::list<std::pair<std::size_t, std::shared_ptr<ByteStore>>> open_;
};

}  // namespace

std::shared_ptr<ByteStore> file_store(std::shared_ptr<const InputFile> file, std::uint64_t skip) {
  return std::make_shared<FileStore>(std::move(file), skip);
}

std::shared_ptr<ByteStore> joined_store(std::vector<Piece> pieces) {
  return std::make_shared<JoinedStore>(std::move(pieces));
}

Error absent_companion(const std::string& name, const std::string& by) {
  return make_error(ErrorKind::not_found, in_quotes(name) + ", referred to by " + in_quotes(by) +
                                              ", is missing; expected in the "
                                              "folder of " +
                                              in_quotes(by));
}

Result<std::shared_ptr<const InputFile>> open_named(Files& files, const std::string& name,
                                                    const std::string& by) {
  auto file = files.open(name);
  if (file || file.error().kind != ErrorKind::not_found) return file;
  return absent_companion(name, by);
}

Result<std::shared_ptr<const InputFile>> open_again(Files& files, const std::string& name,
                                                    const std::string& identity) {
  auto file = files.open(name);
  if (file && (*file)->identity() != identity) {
    return (*file)->fault("has changed since it was opened; open it again");
  }
  return file;
}

}  // namespace windsplat::data::bytes
