// Decoders with copyable state, and the store that resumes from such copies.
#include "server/data/bytes/unrolled.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/check.hpp"
#include "server/data/bytes/text.hpp"

namespace windsplat::data::bytes {

namespace {

constexpr std::size_t window_max = std::size_t{1} << 16;
constexpr std::size_t places_max = 64;
constexpr std::uint64_t first_spacing = std::uint64_t{4} << 20;

// The encoded bytes starting at an offset, partly buffered. A copy has its own buffer.
class Input {
 public:
  Input(std::shared_ptr<const InputFile> file, std::uint64_t at)
      : file_(std::move(file)), at_(at) {}
  Input(const Input& other) : file_(other.file_), at_(other.at_) {}
  Input& operator=(const Input&) = delete;

  // The next bytes, at least one unless the file ends.
  Result<std::string_view> window() {
    if (at_ < begin_ || at_ >= begin_ + bytes_.size()) {
      const std::uint64_t left = file_->size() - std::min(at_, file_->size());
      bytes_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left, window_max)));
      begin_ = at_;
      if (auto done = file_->read(at_, bytes_.data(), bytes_.size()); !done) return done.error();
    }
    return std::string_view(bytes_).substr(static_cast<std::size_t>(at_ - begin_));
  }
  void consume(std::size_t count) { at_ += count; }
  [[nodiscard]] std::uint64_t at() const { return at_; }
  [[nodiscard]] const std::shared_ptr<const InputFile>& file() const { return file_; }

 private:
  std::shared_ptr<const InputFile> file_;
  std::uint64_t at_;
  std::uint64_t begin_ = 0;
  std::string bytes_;
};

class Decoder {
 public:
  virtual ~Decoder() = default;
  Decoder& operator=(const Decoder&) = delete;
  // Up to `count` bytes; 0 only at the end.
  virtual Result<std::size_t> produce(unsigned char* out, std::size_t count) = 0;
  [[nodiscard]] virtual std::unique_ptr<Decoder> copy() const = 0;
  [[nodiscard]] const Input& input() const { return input_; }

 protected:
  explicit Decoder(const Input& input) : input_(input) {}
  Decoder(const Decoder&) = default;
  Input input_;
};

class GzipDecoder final : public Decoder {
 public:
  explicit GzipDecoder(const Input& input) : Decoder(input) {
    WINDSPLAT_CHECK(inflateInit2(&stream_, 15 + 32) ==
                    Z_OK);  // gzip or zlib, detected by the header
  }
  GzipDecoder(const GzipDecoder& other) : Decoder(other), ended_(other.ended_) {
    WINDSPLAT_CHECK(inflateCopy(&stream_, const_cast<z_stream*>(&other.stream_)) == Z_OK);
  }
  GzipDecoder& operator=(const GzipDecoder&) = delete;
  ~GzipDecoder() override { inflateEnd(&stream_); }

  [[nodiscard]] std::unique_ptr<Decoder> copy() const override {
    return std::make_unique<GzipDecoder>(*this);
  }

  Result<std::size_t> produce(unsigned char* out, std::size_t count) override {
    const auto wanted = static_cast<uInt>(std::min<std::size_t>(count, std::size_t{1} << 30));
    stream_.next_out = out;
    stream_.avail_out = wanted;
    while (stream_.avail_out == wanted) {
      auto window = input_.window();
      if (!window) return window.error();
      if (ended_) {  // another member may follow
        if (window->empty() || window->front() == '\0') return 0;
        inflateReset(&stream_);
        ended_ = false;
      }
      // The library takes a non-const pointer to input that it does not change.
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(window->data()));
      stream_.avail_in = static_cast<uInt>(window->size());
      const int status = inflate(&stream_, Z_NO_FLUSH);
      const std::size_t taken = window->size() - stream_.avail_in;
      input_.consume(taken);
      if (status == Z_STREAM_END) {
        ended_ = true;
      } else if (status == Z_MEM_ERROR) {
        return make_error(ErrorKind::out_of_memory, "not enough memory to decompress gzip data");
      } else if (status == Z_BUF_ERROR && window->empty()) {
        return 0;
      } else if (status != Z_OK) {
        return input_.file()->fault("is damaged: its gzip data cannot be decompressed at byte " +
                                    std::to_string(input_.at()));
      }
    }
    return wanted - stream_.avail_out;
  }

 private:
  z_stream stream_{};
  bool ended_ = false;
};

bool is_separator(char c) { return c == ' ' || (c >= '\t' && c <= '\r') || c == ','; }

class HexDecoder final : public Decoder {
 public:
  explicit HexDecoder(const Input& input) : Decoder(input) {}
  [[nodiscard]] std::unique_ptr<Decoder> copy() const override {
    return std::make_unique<HexDecoder>(*this);
  }
  Result<std::size_t> produce(unsigned char* out, std::size_t count) override {
    std::size_t made = 0;
    while (made == 0) {
      auto window = input_.window();
      if (!window) return window.error();
      if (window->empty()) return 0;
      std::size_t used = 0;
      for (; used < window->size() && made < count; ++used) {
        const char c = (*window)[used];
        if (is_separator(c)) continue;
        const int digit = hex_digit(c);
        if (digit < 0) {
          return input_.file()->fault("is damaged: no hexadecimal digit at byte " +
                                      std::to_string(input_.at() + used));
        }
        if (high_ < 0) {
          high_ = digit;
        } else {
          out[made++] = static_cast<unsigned char>(high_ * 16 + digit);
          high_ = -1;
        }
      }
      input_.consume(used);
    }
    return made;
  }

 private:
  int high_ = -1;
};

// Formats written by printf and Fortran: "nan", "-inf", "+1.5e3", "1.0D5".
bool parse_number(std::string token, double& out) {
  std::replace_if(
      token.begin(), token.end(), [](char c) { return c == 'D' || c == 'd'; }, 'e');
  const char* from = token.data() + (token.starts_with('+') ? 1 : 0);
  const char* end = token.data() + token.size();
  const auto [stop, fault] = std::from_chars(from, end, out);
  if (fault == std::errc::result_out_of_range && stop == end) {
    out = 0;  // underflow; overflow is rejected
    return token.find("e-") != std::string::npos;
  }
  return fault == std::errc() && stop == end;
}

class TextDecoder final : public Decoder {
 public:
  explicit TextDecoder(const Input& input) : Decoder(input) {}
  [[nodiscard]] std::unique_ptr<Decoder> copy() const override {
    return std::make_unique<TextDecoder>(*this);
  }
  // Whole numbers only: `count` and all offsets must be multiples of eight.
  Result<std::size_t> produce(unsigned char* out, std::size_t count) override {
    std::size_t made = 0;
    for (; made + sizeof(double) <= count; made += sizeof(double)) {
      auto token = next_token();
      if (!token) return token.error();
      if (token->empty()) return made;
      double value = 0;
      if (!parse_number(*token, value)) {
        return input_.file()->fault("is damaged: " + in_quotes(*token) + " before byte " +
                                    std::to_string(input_.at()) + " is not a number");
      }
      std::memcpy(out + made, &value, sizeof value);
    }
    return made;
  }

 private:
  // Returns an empty token at the end of the file.
  Result<std::string> next_token() {
    constexpr std::size_t token_max = 64;
    std::string token;
    for (;;) {
      auto window = input_.window();
      if (!window) return window.error();
      std::size_t used = 0;
      while (token.empty() && used < window->size() && is_separator((*window)[used])) ++used;
      const std::size_t from = used;
      while (used < window->size() && used - from + token.size() <= token_max &&
             !is_separator((*window)[used])) {
        ++used;
      }
      token.append(window->substr(from, used - from));
      const bool goes_on = used == window->size() && !window->empty();
      input_.consume(used);
      if (!goes_on || token.size() > token_max) return token;
    }
  }
};

std::unique_ptr<Decoder> decoder_of(std::shared_ptr<const InputFile> file, Encoding encoding,
                                    std::uint64_t skip) {
  const Input input(std::move(file), skip);
  if (encoding == Encoding::gzip) return std::make_unique<GzipDecoder>(input);
  if (encoding == Encoding::hex) return std::make_unique<HexDecoder>(input);
  return std::make_unique<TextDecoder>(input);
}

class UnrolledStore final : public ByteStore {
 public:
  UnrolledStore(std::unique_ptr<Decoder> start, std::uint64_t bytes, std::uint64_t drop)
      : now_(start->copy()), bytes_(bytes), drop_(drop) {
    places_.push_back({0, std::move(start)});
  }

  Result<void> read(std::uint64_t offset, unsigned char* out, std::size_t count) override {
    WINDSPLAT_CHECK(offset <= bytes_ && count <= bytes_ - offset);
    offset += drop_;
    // Text is decoded one complete number at a time: align both ends to multiples of a number's
    // size.
    const std::uint64_t ahead = offset % sizeof(double);
    go_back_to(offset - ahead);
    std::vector<unsigned char> scratch(window_max);
    while (at_ < offset - ahead) {
      const std::uint64_t some = std::min<std::uint64_t>(window_max, offset - ahead - at_);
      if (auto done = produce(scratch.data(), some); !done) return done;
    }
    while (count > 0) {
      const std::uint64_t lead = offset % sizeof(double);
      const std::size_t body = count - count % sizeof(double);
      if (lead == 0 && body > 0) {
        if (auto done = produce(out, body); !done) return done;
        out += body;
        offset += body;
        count -= body;
        continue;
      }
      // A single number, of which only some bytes are requested.
      if (auto done = produce(scratch.data(), whole_eight(offset - lead)); !done) return done;
      const std::size_t some = std::min<std::size_t>(count, sizeof(double) - lead);
      std::memcpy(out, scratch.data() + lead, some);
      out += some;
      offset += some;
      count -= some;
    }
    return {};
  }

  [[nodiscard]] Result<void> check_unchanged() const override {
    return now_->input().file()->check_unchanged();
  }

 private:
  struct Place {
    std::uint64_t at;
    std::unique_ptr<Decoder> decoder;
  };

  // Eight bytes, or the rest of the data.
  [[nodiscard]] std::size_t whole_eight(std::uint64_t from) const {
    return static_cast<std::size_t>(std::min<std::uint64_t>(sizeof(double), bytes_ + drop_ - from));
  }

  void go_back_to(std::uint64_t offset) {
    auto best =
        std::upper_bound(places_.begin(), places_.end(), offset,
                         [](std::uint64_t to, const Place& place) { return to < place.at; });
    --best;
    if (at_ <= offset && at_ >= best->at) return;
    now_ = best->decoder->copy();
    at_ = best->at;
  }

  Result<void> produce(unsigned char* out, std::size_t count) {
    while (count > 0) {
      auto made = now_->produce(out, count);
      if (!made) return made.error();
      if (*made == 0) {
        return now_->input().file()->fault("is truncated: its data end after " +
                                           std::to_string(at_) + " of " +
                                           std::to_string(bytes_ + drop_) + " bytes");
      }
      at_ += *made;
      out += *made;
      count -= *made;
      remember();
    }
    return {};
  }

  void remember() {
    if (at_ < places_.back().at + spacing_ || at_ % sizeof(double) != 0) return;
    if (places_.size() == places_max) {  // drop every other checkpoint
      std::vector<Place> kept;
      for (std::size_t i = 0; i < places_.size(); i += 2) kept.push_back(std::move(places_[i]));
      places_ = std::move(kept);
      spacing_ *= 2;
      if (at_ < places_.back().at + spacing_) return;
    }
    places_.push_back({at_, now_->copy()});
  }

  std::unique_ptr<Decoder> now_;
  std::uint64_t at_ = 0;
  std::uint64_t bytes_;
  std::uint64_t drop_;
  std::uint64_t spacing_ = first_spacing;
  std::vector<Place> places_;  // ascending; the first is at offset 0
};

}  // namespace

bool can_hold(Encoding encoding, std::uint64_t encoded, std::uint64_t claim) {
  if (encoding == Encoding::hex) return claim <= encoded / 2;
  if (encoding == Encoding::text) return claim / sizeof(double) <= (encoded + 1) / 2;
  return claim / 1040 <= encoded;  // deflate expands one byte to at most 1032
}

std::shared_ptr<ByteStore> unrolled_store(std::shared_ptr<const InputFile> file, Encoding encoding,
                                          std::uint64_t skip, std::uint64_t bytes,
                                          std::uint64_t drop) {
  return std::make_shared<UnrolledStore>(decoder_of(std::move(file), encoding, skip), bytes, drop);
}

Result<std::uint64_t> end_of_text(const std::shared_ptr<const InputFile>& file, std::uint64_t skip,
                                  std::uint64_t count) {
  const auto decoder = decoder_of(file, Encoding::text, skip);
  std::array<unsigned char, 4096> scratch{};
  for (std::uint64_t left = count * sizeof(double); left > 0;) {
    const auto made = decoder->produce(
        scratch.data(), static_cast<std::size_t>(std::min<std::uint64_t>(left, scratch.size())));
    if (!made) return made.error();
    if (*made == 0) {
      return file->fault("is truncated: " + std::to_string(left / sizeof(double)) + " of the " +
                         std::to_string(count) + " numbers from byte " + std::to_string(skip) +
                         " on are missing");
    }
    left -= *made;
  }
  return decoder->input().at();
}

}  // namespace windsplat::data::bytes
