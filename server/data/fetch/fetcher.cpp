#include "server/data/fetch/fetcher.hpp"

#include <unistd.h>

#include <algorithm>
#include <utility>

namespace windsplat::data::fetch {

namespace {

constexpr std::size_t idle_clients_max = 16;
constexpr int ahead_threads_max = 32;
constexpr std::uint64_t ahead_bytes_max = std::uint64_t{64} << 20;
constexpr std::uint64_t ahead_files = 8;    // fetched as a whole at a time within that
constexpr std::uint64_t ahead_share = 4;    // of the cache
constexpr std::size_t idle_parts_max = 64;  // files open without a reader
constexpr std::uint64_t kept_share = 4;     // of the cache, for a file that was read to its end
constexpr std::size_t list_entries_max = 1'000'000;
constexpr int list_pages_max = 1100;  // pages have 1000 entries
constexpr std::size_t list_page_bytes_max = std::size_t{4} << 20;

Error no_s3(const Url& url) {
  return make_error(ErrorKind::invalid, in_quotes(url.text()) + ": no S3 service is set");
}

Result<FetchedFile> opened(std::shared_ptr<SparseFile> parts) {
  auto file = parts->open();
  if (!file) return file.error();
  std::string state = parts->state();
  return FetchedFile{std::move(*file), std::move(parts), std::move(state)};
}

// Why a part is not one of the file.
Error fault_of_part(const Url& url, const SparseFile& file, const std::string& etag) {
  std::string why = " has changed on its host since it was opened; open it again";
  if (etag == file.validators().etag) {
    why = " is answered with other bytes than those that were asked for";
  } else if (!etag.starts_with('"')) {
    why =
        " is answered without a strong ETag, so that its parts may be of two states; open it again";
  }
  return make_error(ErrorKind::bad_data, in_quotes(url.text()) + why);
}

}  // namespace

Fetcher::Fetcher(FetchOptions options)
    : options_(std::move(options)), rules_(std::make_shared<const HostRules>(options_.rules)) {
  ahead_.all_bytes_max = options_.cache.bytes_max / ahead_share;
  ahead_.bytes_max = std::min(ahead_bytes_max, ahead_.all_bytes_max);
  ahead_.file_bytes_max = ahead_.bytes_max / ahead_files;
}

Result<std::unique_ptr<Fetcher>> Fetcher::open(FetchOptions options) {
  std::unique_ptr<Fetcher> out(new Fetcher(std::move(options)));
  auto cache = ObjectCache::open(out->options_.cache);
  if (!cache) return cache.error();
  out->cache_ = std::move(*cache);
  return out;
}

Result<Request> Fetcher::request_of(const Url& url, const Cancelled& cancelled) const {
  Request out;
  out.url = url;
  if (url.scheme == "s3") {
    if (!options_.s3) return no_s3(url);
    if (url.host == "." || url.host == "..") {
      return make_error(ErrorKind::invalid, in_quotes(url.text()) + ": no such bucket");
    }
    out.url = options_.s3->url_of(url);
    out.key = &options_.s3->key;
  }
  out.limits = options_.limits;
  out.cancelled = [this, cancelled] { return ended_ || (cancelled && cancelled()); };
  return out;
}

Result<void> Fetcher::check(const Location& location) const {
  const auto url = parse_url(location.folder);
  if (!url) return url.error();
  const auto request = request_of(*url, {});
  if (!request) return request.error();
  return rules_->check(request->url);
}

Result<Response> Fetcher::get(const Request& request, const HttpClient::Sink& sink) {
  std::unique_ptr<HttpClient> client;
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      client = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  if (!client) client = std::make_unique<HttpClient>(rules_, options_.authorities);
  auto response = client->get(request, sink);
  const std::lock_guard lock(mutex_);
  if (idle_.size() < idle_clients_max) idle_.push_back(std::move(client));
  return response;
}

Result<FetchedFile> Fetcher::fetch(const std::string& text, Fetch how, const Cancelled& cancelled,
                                   Purpose purpose) {
  const std::size_t mark = std::min(text.find('?'), text.size());
  const auto url = parse_url(std::string_view(text).substr(0, mark));
  if (!url) return url.error();
  auto request = request_of(*url, cancelled);
  if (!request) return request.error();
  if (mark < text.size()) request->query = text.substr(mark + 1);
  if (purpose == Purpose::ahead) {
    request->limits.bytes_max = std::min(request->limits.bytes_max, ahead_.file_bytes_max);
  }
  const std::string key = request->url.text() + text.substr(mark);
  if (auto permitted = rules_->check(request->url); !permitted) return permitted.error();
  const bool wants_parts = how == Fetch::parts;
  if (noted_.is_unfit(key) || noted_.was_whole(key)) how = Fetch::whole;
  auto parts = how == Fetch::parts ? find_parts(key) : std::nullopt;
  if (parts && Clock::now() - parts->confirmed < options_.cache.fresh_time) {
    return opened(std::move(parts->file));
  }
  auto known = parts ? std::nullopt : cache_->find(key);
  const std::string kept = known ? state_of_kept(key, *known) : "";
  if (known && kept.empty() && wants_parts) noted_.note_whole(key);
  if (known && known->is_fresh) return FetchedFile{std::move(known->file), nullptr, kept};
  if (parts) request->known = parts->file->validators();
  if (known) request->known = known->validators;
  if (known) request->known_bytes = known->bytes;
  if (how == Fetch::parts) request->range = ByteRange{0, SparseFile::begin_bytes};
  auto part = cache_->begin();
  if (!part) return part.error();
  const auto response =
      get(*request, [&part](std::string_view bytes) { return part->append(bytes); });
  if (!response) {
    noted_.forget_whole(key);
    if (response.error().kind == ErrorKind::not_found) {
      cache_->remove(key);
      forget_parts(key);
    }
    return response.error();
  }
  if (response->is_unchanged) {
    if (parts) {
      keep_parts(key, parts->file);
      return opened(std::move(parts->file));
    }
    cache_->confirm(key);
    return FetchedFile{std::move(known->file), nullptr, kept};
  }
  if (response->file_bytes > part->bytes()) {
    cache_->remove(key);
    auto sparse = SparseFile::make(key, std::move(*part), *response, options_.limits.bytes_max);
    if (!sparse) return sparse.error();
    keep_parts(key, *sparse);
    return opened(std::move(*sparse));
  }
  forget_parts(key);
  auto file = cache_->keep(key, std::move(*part), response->validators);
  if (!file) return file.error();
  return FetchedFile{std::move(*file), nullptr, {}};
}

Result<Extent> Fetcher::fetch_part(const std::string& text, SparseFile& file, std::uint64_t offset,
                                   std::uint64_t count, const Cancelled& cancelled,
                                   Purpose purpose) {
  const auto url = parse_url(text);
  if (!url) return url.error();
  auto request = request_of(*url, cancelled);
  if (!request) return request.error();
  request->state = file.validators().etag;
  request->state_bytes = file.bytes();
  const auto get_bytes = [&](ByteRange range, const HttpClient::Sink& sink) -> Result<void> {
    request->range = range;
    request->limits.bytes_max = range.count;
    const auto response = get(*request, sink);
    if (!response) return response.error();
    if (!response->is_other_part) return {};
    if (file.bytes() <= options_.limits.bytes_max) noted_.note_unfit(file.url());
    return fault_of_part(request->url, file, response->validators.etag);
  };
  drop_idle_parts(std::min(count, file.bytes()));
  auto out = file.fetch(offset, count, get_bytes, request->cancelled, purpose);
  if (out && file.fetched_bytes() >= file.bytes()) keep_whole(file);
  if (out) return out;
  const ErrorKind kind = out.error().kind;
  const bool is_gone = kind == ErrorKind::bad_data || kind == ErrorKind::not_found;
  if (is_gone && purpose == Purpose::read) forget_parts(file.url());
  return out;
}

bool Fetcher::AheadLimits::begin() {
  if (++threads <= ahead_threads_max) return true;
  --threads;
  return false;
}

// It is in use as it is: what cannot be kept is fetched again by the next program.
void Fetcher::keep_whole(const SparseFile& file) {
  constexpr std::size_t copied_at_once = std::size_t{1} << 20;
  if (file.bytes() > options_.cache.bytes_max / kept_share) return;
  if (!noted_.note_kept(file.state())) return;
  const auto from = file.open();
  auto part = cache_->begin();
  if (!from || !part) return;
  std::string bytes(copied_at_once, '\0');
  while (part->bytes() < file.bytes()) {
    const ssize_t got = ::read(from->number(), bytes.data(), bytes.size());
    if (got <= 0 || !part->append({bytes.data(), static_cast<std::size_t>(got)})) return;
  }
  static_cast<void>(cache_->keep(file.url(), std::move(*part), file.validators()));
}

// Datasets that were opened when it was in parts know it by that state.
std::string Fetcher::state_of_kept(const std::string& key, const ObjectCache::Entry& entry) {
  std::string state = state_of(key, entry.bytes, entry.validators.etag);
  return noted_.is_kept(state) ? state : "";
}

std::optional<Fetcher::KnownParts> Fetcher::find_parts(const std::string& key) {
  const std::lock_guard lock(mutex_);
  const auto at = std::find_if(parts_.begin(), parts_.end(),
                               [&](const KnownParts& known) { return known.key == key; });
  if (at == parts_.end()) return {};
  parts_.splice(parts_.begin(), parts_, at);
  return *at;
}

void Fetcher::keep_parts(const std::string& key, std::shared_ptr<SparseFile> file) {
  const std::lock_guard lock(mutex_);
  parts_.remove_if([&](const KnownParts& known) { return known.key == key; });
  parts_.push_front({key, std::move(file), Clock::now()});
  std::size_t idle = 0;
  parts_.remove_if([&](const KnownParts& known) {
    return known.file.use_count() == 1 && ++idle > idle_parts_max;
  });
}

void Fetcher::forget_parts(const std::string& key) {
  const std::lock_guard lock(mutex_);
  parts_.remove_if([&](const KnownParts& known) { return known.key == key; });
}

void Fetcher::drop_idle_parts(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  for (auto at = parts_.end(); at != parts_.begin();) {
    constexpr std::uint64_t ahead = SparseFile::blocks_ahead_max * SparseFile::block_bytes;
    if (cache_->bytes() + bytes + ahead <= options_.cache.bytes_max) return;
    --at;
    if (at->file.use_count() == 1) at = parts_.erase(at);
  }
}

Result<std::vector<std::string>> Fetcher::list(const std::string& folder_url,
                                               const Cancelled& cancelled) {
  const auto url = parse_url(folder_url);
  if (!url) return url.error();
  if (url->scheme != "s3") {
    return make_error(ErrorKind::bad_data,
                      in_quotes(url->text()) +
                          " cannot be listed: over http a Zarr store needs consolidated metadata");
  }
  auto request = request_of(*url, cancelled);
  if (!request) return request.error();
  request->url = options_.s3->bucket_of(*url);
  request->limits.bytes_max = list_page_bytes_max;
  request->limits.bytes_name = "a page of a list";
  std::string prefix = percent_decoded(url->path.substr(1));
  if (!prefix.empty() && !prefix.ends_with('/')) prefix += '/';
  std::vector<std::string> out;
  std::string continuation;
  int pages = 0;
  do {
    request->query = list_query(prefix, continuation);
    std::string xml;
    const auto response = get(*request, [&xml](std::string_view bytes) {
      xml += bytes;
      return true;
    });
    if (!response) return response.error();
    auto page = parse_list(xml, prefix);
    if (!page || (!continuation.empty() && page->continuation == continuation)) {
      return make_error(ErrorKind::bad_data, in_quotes(url->text()) +
                                                 " is listed by an answer that is not a list of "
                                                 "objects (ListObjectsV2)");
    }
    out.insert(out.end(), page->names.begin(), page->names.end());
    continuation = std::move(page->continuation);
    if (out.size() > list_entries_max || ++pages > list_pages_max) {
      return make_error(ErrorKind::bad_data, in_quotes(url->text()) + " has more than " +
                                                 std::to_string(list_entries_max) + " entries");
    }
  } while (!continuation.empty());
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace windsplat::data::fetch
