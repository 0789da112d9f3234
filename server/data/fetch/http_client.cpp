// The only use of libcurl. Each redirect is a request of its own, whose URL is checked like the
// first; the address of each connection is checked after the name was resolved.
#include "server/data/fetch/http_client.hpp"

#include <curl/curl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <new>
#include <optional>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/fetch/content_range.hpp"

namespace windsplat::data::fetch {

namespace {

constexpr std::size_t discarded_bytes_max = std::size_t{64} << 10;  // of the body of an error
constexpr long ok = 200;
constexpr long partial_content = 206;
constexpr long not_modified = 304;
constexpr long no_such_range = 416;

struct ListDeleter {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
using HeaderList = std::unique_ptr<curl_slist, ListDeleter>;

void start_library() {
  static std::once_flag once;
  std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
}

// What was received of a body before its connection ended.
struct Part {
  std::uint64_t bytes = 0;
  std::uint64_t total = 0;  // of the file, by the first answer; 0: unknown
  std::string etag;
};

// One request as the callbacks of libcurl see it.
struct Exchange {
  CURL* curl = nullptr;
  const HostRules* rules = nullptr;
  const Request* request = nullptr;
  const HttpClient::Sink* sink = nullptr;
  Part part;  // asks for the rest of it
  Response response;
  std::string encoding;
  std::string range;
  std::size_t header_bytes = 0;
  std::uint64_t body_bytes = 0;
  bool address_refused = false;
  bool too_large = false;
  bool header_too_large = false;
  bool is_stored = false;  // a part of the body at least
  bool not_stored = false;
  bool encoded = false;
  bool has_length = false;  // the end of the body is known
  bool wrong_part = false;  // not the bytes that were asked for, or of another state

  // A strong ETag that the answer must have; empty: any.
  [[nodiscard]] const std::string& state() const {
    return part.bytes > 0 ? part.etag : request->state;
  }
  // Whether the body of an answer with this status is what was asked for, or must be checked.
  [[nodiscard]] bool has_body(long status) const {
    if (status == partial_content) return part.bytes > 0 || request->range;
    return status == ok && part.bytes == 0 && request->state.empty();
  }
  [[nodiscard]] bool is_refused() const { return header_too_large || wrong_part; }
};

long status_of(CURL* curl) {
  long status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
  return status;
}

// Validators are sent back and stored as a line of text.
std::string_view validator(std::string_view value) {
  constexpr std::size_t bytes_max = 1024;
  const bool plain =
      value.size() <= bytes_max &&
      std::all_of(value.begin(), value.end(), [](char c) { return c >= ' ' && c <= '~'; });
  return plain ? value : std::string_view();
}

// The number of bytes of an answer 206 that is all that was asked for of the same file; hosts may
// ignore If-Range, or send less. Empty: it is something else.
std::optional<std::uint64_t> bytes_of_wanted_part(const Exchange& exchange) {
  const Request& request = *exchange.request;
  const std::string& etag = exchange.response.validators.etag;
  if (!etag.starts_with('"')) return {};
  if (!exchange.state().empty() && etag != exchange.state()) return {};
  const std::uint64_t received = exchange.part.bytes;
  const std::uint64_t total = received > 0 ? exchange.part.total : request.state_bytes;
  if (total == 0 && !exchange.state().empty()) return {};
  const auto [first, count] = request.range.value_or(ByteRange{0, ~std::uint64_t{0}});
  return bytes_of_part(exchange.range, first + received, count - received, total);
}

// Whether it is that part so far.
bool is_wanted_part(const Exchange& exchange) {
  const auto wanted = bytes_of_wanted_part(exchange);
  curl_off_t length = -1;
  curl_easy_getinfo(exchange.curl, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
  return wanted && exchange.body_bytes <= *wanted &&
         (length < 0 || static_cast<std::uint64_t>(length) == *wanted);
}

// Whether an answer with a body is the known file of a host without ETags.
bool is_known(const Exchange& exchange) {
  const Validators& known = exchange.request->known;
  const Validators& now = exchange.response.validators;
  curl_off_t length = -1;
  curl_easy_getinfo(exchange.curl, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
  return known.etag.empty() && now.etag.empty() && !known.last_modified.empty() &&
         now.last_modified == known.last_modified && length > 0 &&
         static_cast<std::uint64_t>(length) == exchange.request->known_bytes;
}

// Callbacks have the types of libcurl.
std::size_t on_header(char* data, std::size_t size, std::size_t count, void* user) {
  auto& exchange = *static_cast<Exchange*>(user);
  const std::string_view line(data, size * count);
  exchange.header_bytes += line.size();
  exchange.header_too_large = exchange.header_bytes > header_bytes_max;
  if (exchange.header_too_large) return 0;
  if (line.starts_with("HTTP/")) {  // a final response after an interim one
    exchange.response.validators = {};
    exchange.encoding.clear();
    exchange.has_length = false;
    exchange.range.clear();
  }
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) return line.size();
  const std::string name = lower(line.substr(0, colon));
  const std::string_view value = trim(line.substr(colon + 1));
  if (name == "etag") exchange.response.validators.etag = validator(value);
  if (name == "last-modified") exchange.response.validators.last_modified = validator(value);
  if (name == "content-length" ||
      (name == "transfer-encoding" && lower(value).ends_with("chunked"))) {
    exchange.has_length = true;
  }
  if (name == "content-encoding") exchange.encoding = lower(value);
  if (name == "content-range") exchange.range = value;
  return line.size();
}

std::size_t on_body(char* data, std::size_t size, std::size_t count, void* user) {
  auto& exchange = *static_cast<Exchange*>(user);
  const std::string_view bytes(data, size * count);
  exchange.body_bytes += bytes.size();
  const long status = status_of(exchange.curl);
  const bool is_coded = !exchange.encoding.empty() && exchange.encoding != "identity";
  exchange.encoded = is_coded && exchange.has_body(status);
  if (exchange.encoded) return 0;
  // A host that ignores the range, or whose file has changed, answers 200 (RFC 9110, 13.1.5).
  exchange.wrong_part =
      (status == ok && !exchange.state().empty()) ||
      (status == partial_content && exchange.has_body(status) && !is_wanted_part(exchange));
  if (exchange.wrong_part) return 0;
  exchange.response.is_unchanged = status == ok && exchange.part.bytes == 0 && is_known(exchange);
  if (!exchange.has_body(status) || exchange.response.is_unchanged) {
    // Reading a short body to its end keeps the connection usable.
    return exchange.body_bytes <= discarded_bytes_max ? bytes.size() : 0;
  }
  exchange.too_large =
      exchange.part.bytes + exchange.body_bytes > exchange.request->limits.bytes_max;
  if (exchange.too_large || !exchange.has_length) return 0;
  exchange.is_stored = true;
  exchange.not_stored = !(*exchange.sink)(bytes);
  return exchange.not_stored ? 0 : bytes.size();
}

int on_progress(void* user, curl_off_t /*expected*/, curl_off_t /*received*/,
                curl_off_t /*to_send*/, curl_off_t /*sent*/) {
  const auto& cancelled = static_cast<Exchange*>(user)->request->cancelled;
  return cancelled && cancelled() ? 1 : 0;
}

curl_socket_t on_socket(void* user, curlsocktype /*purpose*/, curl_sockaddr* address) {
  auto& exchange = *static_cast<Exchange*>(user);
  if (!exchange.rules->permits(&address->addr)) {
    exchange.address_refused = true;
    return CURL_SOCKET_BAD;
  }
  return ::socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
}

Error fault(ErrorKind kind, const Url& url, const std::string& what) {
  return make_error(kind, in_quotes(url.text()) + ' ' + what);
}

Error fault_of_status(const Url& url, long status) {
  const std::string text = "is answered with status " + std::to_string(status);
  if (status == 404 || status == 410) {
    return fault(ErrorKind::not_found, url, text + ": no such file");
  }
  return fault(ErrorKind::bad_data, url,
               status == 401 || status == 403 ? text + ": not permitted" : text);
}

Error fault_of_transfer(const Exchange& exchange, const Url& url, CURLcode code,
                        const std::string& detail) {
  const RequestLimits& limits = exchange.request->limits;
  if (code == CURLE_ABORTED_BY_CALLBACK) return fault(ErrorKind::cancelled, url, "was cancelled");
  if (exchange.address_refused) {
    return fault(
        ErrorKind::invalid, url,
        "has an address in a private or reserved network; --allow-private-data-hosts permits "
        "private ones");
  }
  if (exchange.too_large || code == CURLE_FILESIZE_EXCEEDED) {
    return fault(ErrorKind::too_large, url,
                 "has more than the " + std::to_string(limits.bytes_max) + " bytes of " +
                     std::string(limits.bytes_name));
  }
  if (exchange.header_too_large) {
    return fault(
        ErrorKind::bad_data, url,
        "is answered with a header of more than " + std::to_string(header_bytes_max) + " bytes");
  }
  if (exchange.encoded) {
    return fault(ErrorKind::bad_data, url,
                 "is sent with the content coding " + in_quotes(exchange.encoding) +
                     ", which was not asked for");
  }
  if (exchange.body_bytes > 0 && !exchange.has_length) {
    return fault(ErrorKind::bad_data, url,
                 "is sent without a length, so that a part could not be told from the whole");
  }
  if (exchange.not_stored) {
    return fault(ErrorKind::out_of_memory, url, "cannot be stored in the folder of --data-cache");
  }
  if (code == CURLE_OPERATION_TIMEDOUT) {
    return fault(ErrorKind::bad_data, url,
                 "was not received within " + std::to_string(limits.time.count() / 1000) +
                     " s (--max-download-time), or at less than " +
                     std::to_string(stall_bytes_per_second) + " bytes a second for " +
                     std::to_string(limits.stall_time.count()) + " s");
  }
  const std::uint64_t received = exchange.part.bytes + exchange.body_bytes;
  if (exchange.wrong_part) {
    return fault(ErrorKind::bad_data, url,
                 exchange.part.bytes == 0
                     ? "is answered with other bytes than those that were asked for"
                     : "was received incompletely: after " + std::to_string(exchange.part.bytes) +
                           " bytes the host does not send the rest of the same file");
  }
  if (code == CURLE_PARTIAL_FILE) {
    return fault(ErrorKind::bad_data, url,
                 "was received incompletely: the connection ended after " +
                     std::to_string(received) + " bytes");
  }
  return fault(
      ErrorKind::bad_data, url,
      "cannot be fetched: " + printable(detail.empty() ? curl_easy_strerror(code) : detail));
}

void append(HeaderList& list, const std::string& line) {
  curl_slist* const longer = curl_slist_append(list.get(), line.c_str());
  if (longer == nullptr) throw std::bad_alloc();
  static_cast<void>(list.release());
  list.reset(longer);
}

HeaderList headers_of(const Request& request, const Part& part) {
  HeaderList out;
  const std::string& state = part.bytes > 0 ? part.etag : request.state;
  if (!state.empty()) append(out, "If-Range: " + state);
  if (!request.known.etag.empty()) append(out, "If-None-Match: " + request.known.etag);
  // S3 requires the SHA-256 of the body, which is empty.
  if (request.key != nullptr && !request.key->id.empty()) {
    append(out,
           "x-amz-content-sha256: "
           "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  }
  if (request.key != nullptr && !request.key->session_token.empty()) {
    append(out, "x-amz-security-token: " + request.key->session_token);
  }
  return out;
}

// Bytes of the file of which an answer has all or a part; 0: unknown.
std::uint64_t total_of(const Exchange& exchange) {
  if (const auto range = parse_content_range(exchange.range)) return range->total;
  curl_off_t length = -1;
  curl_easy_getinfo(exchange.curl, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
  return length > 0 ? static_cast<std::uint64_t>(length) : 0;
}

// Whether the rest of a file can be asked for: by a strong validator, if anything was received.
bool may_resume(const Exchange& exchange, CURLcode code, long status) {
  const std::string& etag = exchange.response.validators.etag;
  return (code == CURLE_PARTIAL_FILE || code == CURLE_RECV_ERROR) && exchange.body_bytes > 0 &&
         exchange.has_body(status) && !exchange.is_refused() && etag.starts_with('"') &&
         (exchange.part.bytes == 0 || etag == exchange.part.etag);
}

}  // namespace

struct HttpClient::Handle {
  CURL* curl = curl_easy_init();
  std::array<char, CURL_ERROR_SIZE> detail{};

  Handle() {
    if (curl == nullptr) throw std::bad_alloc();
  }
  ~Handle() { curl_easy_cleanup(curl); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  template <class Value>
  void set(CURLoption option, Value value) const {
    curl_easy_setopt(curl, option, value);
  }

  // Keeps connections and resolved names of earlier requests.
  void prepare(const Request& request, const std::string& authorities) {
    curl_easy_reset(curl);
    detail[0] = '\0';
    set(CURLOPT_ERRORBUFFER, detail.data());
    set(CURLOPT_NOSIGNAL, 1L);
    set(CURLOPT_PROTOCOLS_STR, request.url.scheme.c_str());
    set(CURLOPT_FOLLOWLOCATION, 0L);
    set(CURLOPT_PROXY, "");
    set(CURLOPT_NETRC, static_cast<long>(CURL_NETRC_IGNORED));
    set(CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_1));
    set(CURLOPT_SSL_VERIFYPEER, 1L);
    set(CURLOPT_SSL_VERIFYHOST, 2L);
    set(CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
    if (!authorities.empty()) set(CURLOPT_CAINFO, authorities.c_str());
    set(CURLOPT_MAXCONNECTS, 4L);
    set(CURLOPT_HTTP_CONTENT_DECODING, 0L);
    set(CURLOPT_USERAGENT, "windsplat/" WINDSPLAT_VERSION);
    const RequestLimits& limits = request.limits;
    set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(limits.connect_time.count()));
    set(CURLOPT_LOW_SPEED_LIMIT, stall_bytes_per_second);
    set(CURLOPT_LOW_SPEED_TIME, static_cast<long>(limits.stall_time.count()));
    // The whole file in place of a part is refused for another reason than its size.
    if (request.state.empty()) {
      set(CURLOPT_MAXFILESIZE_LARGE, static_cast<curl_off_t>(limits.bytes_max));
    }
  }

  CURLcode perform(Exchange& exchange, const std::string& authorities,
                   std::chrono::milliseconds left);

  void sign(const S3Key& key) const {
    const std::string user = key.id + ':' + key.secret;
    set(CURLOPT_AWS_SIGV4, ("aws:amz:" + key.region + ":s3").c_str());
    set(CURLOPT_USERPWD, user.c_str());
  }
};

HttpClient::HttpClient(std::shared_ptr<const HostRules> rules, std::string authorities)
    : rules_(std::move(rules)), authorities_(std::move(authorities)) {
  start_library();
  handle_ = std::make_unique<Handle>();
}

HttpClient::~HttpClient() = default;

// The value of the header Range; empty: the whole file.
std::string range_of(const Request& request, const Part& part) {
  if (!request.range) return part.bytes == 0 ? "" : std::to_string(part.bytes) + '-';
  const auto [first, count] = *request.range;
  return std::to_string(first + part.bytes) + '-' + std::to_string(first + count - 1);
}

// Sends one request and receives its answer.
CURLcode HttpClient::Handle::perform(Exchange& exchange, const std::string& authorities,
                                     std::chrono::milliseconds left) {
  const Request& request = *exchange.request;
  exchange.curl = curl;
  prepare(request, authorities);
  set(CURLOPT_TIMEOUT_MS, std::max<long>(1, static_cast<long>(left.count())));
  const std::string target =
      request.url.text() + (request.query.empty() ? "" : '?' + request.query);
  set(CURLOPT_URL, target.c_str());
  set(CURLOPT_PATH_AS_IS, 1L);
  const HeaderList headers = headers_of(request, exchange.part);
  set(CURLOPT_HTTPHEADER, headers.get());
  const std::string range = range_of(request, exchange.part);
  if (!range.empty()) set(CURLOPT_RANGE, range.c_str());
  set(CURLOPT_HEADERFUNCTION, &on_header);
  set(CURLOPT_HEADERDATA, &exchange);
  set(CURLOPT_WRITEFUNCTION, &on_body);
  set(CURLOPT_WRITEDATA, &exchange);
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_XFERINFOFUNCTION, &on_progress);
  set(CURLOPT_XFERINFODATA, &exchange);
  set(CURLOPT_OPENSOCKETFUNCTION, &on_socket);
  set(CURLOPT_OPENSOCKETDATA, &exchange);
  if (request.key != nullptr && !request.key->id.empty()) sign(*request.key);
  const CURLcode code = curl_easy_perform(curl);
  // The list is freed.
  set(CURLOPT_HTTPHEADER, static_cast<curl_slist*>(nullptr));
  return code;
}

// The URL to which a request is redirected, if it may go there. Errors: those of get().
Result<void> HttpClient::redirect(Request& request, long status, std::string_view next) const {
  if (request.key != nullptr) {
    return fault(ErrorKind::bad_data, request.url,
                 "is redirected (status " + std::to_string(status) +
                     "), which a service of s3:// URLs must not do: check region and endpoint");
  }
  // A query of the new URL may be a signature, so it is sent, but not shown.
  const std::size_t mark = next.find('?');
  auto url = parse_url(next.substr(0, mark));
  if (!url) {
    return fault(ErrorKind::bad_data, request.url,
                 "is redirected to a URL that is not valid: " + url.error().message);
  }
  if (request.url.scheme == "https" && url->scheme != "https") {
    return fault(ErrorKind::invalid, request.url, "is redirected from https to " + url->scheme);
  }
  if (auto permitted = rules_->check(*url); !permitted) {
    return fault(ErrorKind::invalid, request.url,
                 "is redirected to another host: " + permitted.error().message);
  }
  request.known.last_modified.clear();  // says nothing of another file, which may be older
  request.query = mark == std::string_view::npos ? "" : std::string(next.substr(mark + 1));
  request.url = std::move(*url);
  return {};
}

Result<Response> HttpClient::get(const Request& first, const Sink& sink) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() + first.limits.time;
  Request request = first;
  Part part;
  int hops = 0;
  for (int resumed = 0;;) {
    if (auto permitted = rules_->check(request.url); !permitted) return permitted.error();
    Exchange exchange;
    exchange.rules = rules_.get();
    exchange.request = &request;
    exchange.sink = &sink;
    exchange.part = part;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now());
    const CURLcode code = handle_->perform(exchange, authorities_, left);
    const long status = status_of(handle_->curl);
    const bool is_part = status == partial_content;
    if (exchange.response.is_unchanged) return {{.is_unchanged = true, .validators = first.known}};
    // An empty body is not seen before its end.
    if (code == CURLE_OK && is_part && exchange.has_body(status)) {
      exchange.wrong_part = exchange.body_bytes != bytes_of_wanted_part(exchange);
    }
    if (code == CURLE_OK && status == ok) exchange.wrong_part = !exchange.state().empty();
    if (code == CURLE_OK && exchange.has_body(status) && !exchange.wrong_part) {
      if (is_part && request.range) exchange.response.file_bytes = total_of(exchange);
      return std::move(exchange.response);
    }
    if (may_resume(exchange, code, status) && ++resumed <= resumptions_max) {
      if (part.bytes == 0) part.total = total_of(exchange);
      if (!is_part) request.range.reset();
      part.etag = exchange.response.validators.etag;
      part.bytes += exchange.body_bytes;
      request.known = {};
      continue;
    }
    // The host cannot send parts of a file in a known state, or this one has no first byte.
    if (request.range && request.state.empty() && part.bytes == 0 && !exchange.is_stored &&
        (exchange.wrong_part || status == no_such_range)) {
      request.range.reset();
      continue;
    }
    exchange.response.is_other_part = exchange.wrong_part && !request.state.empty();
    if (exchange.response.is_other_part) return std::move(exchange.response);
    // The body of an error may be longer than what is discarded.
    const bool is_error_body = code == CURLE_WRITE_ERROR && status > ok &&
                               !exchange.has_body(status) && !exchange.is_refused();
    if (exchange.wrong_part || (code != CURLE_OK && !is_error_body)) {
      return fault_of_transfer(exchange, request.url, code, handle_->detail.data());
    }
    if (status == not_modified && !request.known.etag.empty()) {
      return Response{.is_unchanged = true, .validators = first.known};
    }
    char* location = nullptr;
    curl_easy_getinfo(handle_->curl, CURLINFO_REDIRECT_URL, &location);
    if (status < 301 || status > 308 || location == nullptr) {
      return fault_of_status(request.url, status);
    }
    if (++hops > redirects_max) {
      return fault(ErrorKind::bad_data, first.url,
                   "is redirected more than " + std::to_string(redirects_max) + " times");
    }
    if (auto done = redirect(request, status, location); !done) return done.error();
  }
}

}  // namespace windsplat::data::fetch
