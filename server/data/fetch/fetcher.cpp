#include "server/data/fetch/fetcher.hpp"

#include <algorithm>
#include <utility>

namespace windsplat::data::fetch {

namespace {

constexpr std::size_t idle_clients_max = 8;
constexpr std::size_t idle_parts_max = 64;  // files open without a reader
constexpr std::size_t list_entries_max = 1'000'000;
constexpr int list_pages_max = 1100;  // pages have 1000 entries
constexpr std::size_t list_page_bytes_max = std::size_t{4} << 20;

Error no_s3(const Url& url) {
  return make_error(ErrorKind::invalid, in_quotes(url.text()) + ": no S3 service is set");
}

Result<FetchedFile> opened(std::shared_ptr<SparseFile> parts) {
  auto file = parts->open();
  if (!file) return file.error();
  return FetchedFile{std::move(*file), std::move(parts)};
}

}  // namespace

Fetcher::Fetcher(FetchOptions options)
    : options_(std::move(options)), rules_(std::make_shared<const HostRules>(options_.rules)) {}

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

Result<FetchedFile> Fetcher::fetch(const std::string& text, Fetch how, const Cancelled& cancelled) {
  const std::size_t mark = std::min(text.find('?'), text.size());
  const auto url = parse_url(std::string_view(text).substr(0, mark));
  if (!url) return url.error();
  auto request = request_of(*url, cancelled);
  if (!request) return request.error();
  if (mark < text.size()) request->query = text.substr(mark + 1);
  const std::string key = request->url.text() + text.substr(mark);
  if (auto permitted = rules_->check(request->url); !permitted) return permitted.error();
  auto parts = how == Fetch::parts ? find_parts(key) : std::nullopt;
  if (parts && Clock::now() - parts->confirmed < options_.cache.fresh_time) {
    return opened(std::move(parts->file));
  }
  auto known = parts ? std::nullopt : cache_->find(key);
  if (known && known->is_fresh) return FetchedFile{std::move(known->file), nullptr};
  if (parts) request->known = parts->file->validators();
  if (known) request->known = known->validators;
  if (known) request->known_bytes = known->bytes;
  if (how == Fetch::parts) request->range = ByteRange{0, SparseFile::begin_bytes};
  auto part = cache_->begin();
  if (!part) return part.error();
  const auto response =
      get(*request, [&part](std::string_view bytes) { return part->append(bytes); });
  if (!response) {
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
    return FetchedFile{std::move(known->file), nullptr};
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
  return FetchedFile{std::move(*file), nullptr};
}

Result<Extent> Fetcher::fetch_part(const std::string& text, SparseFile& file, std::uint64_t offset,
                                   std::uint64_t count, const Cancelled& cancelled) {
  const auto url = parse_url(text);
  if (!url) return url.error();
  auto request = request_of(*url, cancelled);
  if (!request) return request.error();
  request->state = file.validators().etag;
  request->state_bytes = file.bytes();
  const auto get_bytes = [&](ByteRange range, const HttpClient::Sink& sink) -> Result<void> {
    drop_idle_parts();
    request->range = range;
    request->limits.bytes_max = range.count;
    const auto response = get(*request, sink);
    if (!response) return response.error();
    return {};
  };
  auto out = file.fetch(offset, count, get_bytes, request->cancelled);
  // Whoever opens it next asks for its state.
  if (!out && out.error().kind == ErrorKind::bad_data) forget_parts(request->url.text());
  return out;
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

void Fetcher::drop_idle_parts() {
  const std::lock_guard lock(mutex_);
  for (auto at = parts_.end(); at != parts_.begin();) {
    constexpr std::uint64_t margin = SparseFile::blocks_ahead_max * SparseFile::block_bytes;
    if (cache_->bytes() + margin <= options_.cache.bytes_max) return;
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
