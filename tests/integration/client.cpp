// Sockets with poll(); HTTP/1.1 and RFC 6455 as far as the tests need them.
#include "client.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>

namespace server_test {
namespace {

using Clock = std::chrono::steady_clock;

int left_ms(Clock::time_point end) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
  return static_cast<int>(std::max<std::int64_t>(0, left.count()));
}

Clock::time_point in_ms(int timeout_ms) {
  return Clock::now() + std::chrono::milliseconds(timeout_ms);
}

std::string in_small_letters(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

void parse_head(const std::string& head, Answer& answer) {
  if (head.compare(0, 9, "HTTP/1.1 ") != 0) return;
  answer.status = std::stoi(head.substr(9, 3));
  std::size_t at = head.find("\r\n") + 2;
  while (at < head.size()) {
    const std::size_t end = head.find("\r\n", at);
    const std::size_t colon = head.find(": ", at);
    if (end == std::string::npos || colon == std::string::npos || end == at) return;
    answer.headers[in_small_letters(head.substr(at, colon - at))] =
        head.substr(colon + 2, end - colon - 2);
    at = end + 2;
  }
}

void add_headers(const Headers& headers, std::string& text) {
  for (const auto& [name, value] : headers) {
    text += name;
    text += ": ";
    text += value;
    text += "\r\n";
  }
}

std::string type_of(const std::string& text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  return json.is_object() ? json.value("type", "") : "";
}

}  // namespace

struct Socket::Tls {
  Tls() : context(SSL_CTX_new(TLS_client_method())), ssl(SSL_new(context)) {}
  ~Tls() {
    SSL_free(ssl);
    SSL_CTX_free(context);
  }
  Tls(const Tls&) = delete;
  Tls& operator=(const Tls&) = delete;

  SSL_CTX* context;
  SSL* ssl;
};

Socket::Socket(Place place, int receive_buffer_bytes) {
  handle_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (receive_buffer_bytes > 0) {
    ::setsockopt(handle_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes,
                 sizeof receive_buffer_bytes);
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(place.port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(handle_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(handle_);
    handle_ = -1;
  }
  if (handle_ < 0 || !place.tls) return;
  std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes without MSG_NOSIGNAL
  ::fcntl(handle_, F_SETFL, ::fcntl(handle_, F_GETFL) | O_NONBLOCK);
  tls_ = std::make_unique<Tls>();
  constexpr std::array<unsigned char, 12> protocols{2,   'h', '2', 8,   'h', 't',
                                                    't', 'p', '/', '1', '.', '1'};
  SSL_set_alpn_protos(tls_->ssl, protocols.data(), protocols.size());
  SSL_set_fd(tls_->ssl, handle_);
  int result = 0;
  do {
    result = SSL_connect(tls_->ssl);
  } while (result != 1 && wait_for(result, patience_ms));
  shaken_ = result == 1;
}

Socket::~Socket() {
  if (handle_ >= 0) ::close(handle_);
}

// Waits for the socket as OpenSSL requires; false on a deadline or another error.
bool Socket::wait_for(int ssl_result, int timeout_ms) {
  const int wanted = SSL_get_error(tls_->ssl, ssl_result);
  if (wanted != SSL_ERROR_WANT_READ && wanted != SSL_ERROR_WANT_WRITE) return false;
  pollfd ready{handle_, static_cast<short>(wanted == SSL_ERROR_WANT_READ ? POLLIN : POLLOUT), 0};
  return ::poll(&ready, 1, timeout_ms) > 0;
}

bool Socket::send(std::string_view bytes) {
  if (handle_ < 0) return false;
  const auto end = in_ms(patience_ms);
  while (!bytes.empty() && tls_) {
    const int sent = SSL_write(tls_->ssl, bytes.data(), static_cast<int>(bytes.size()));
    if (sent <= 0 && !wait_for(sent, left_ms(end))) return false;
    bytes.remove_prefix(static_cast<std::size_t>(std::max(0, sent)));
  }
  while (!bytes.empty()) {
    pollfd ready{handle_, POLLOUT, 0};
    if (::poll(&ready, 1, left_ms(end)) <= 0) return false;
    const auto sent = ::send(handle_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

std::string Socket::receive(int timeout_ms) {
  if (handle_ < 0) return {};
  std::string bytes(65536, '\0');
  if (tls_) {
    const auto end = in_ms(timeout_ms);
    int got = 0;
    do {
      got = SSL_read(tls_->ssl, bytes.data(), static_cast<int>(bytes.size()));
    } while (got <= 0 && wait_for(got, left_ms(end)));
    bytes.resize(static_cast<std::size_t>(std::max(0, got)));
    return bytes;
  }
  pollfd ready{handle_, POLLIN, 0};
  if (::poll(&ready, 1, timeout_ms) <= 0) return {};
  const auto got = ::recv(handle_, bytes.data(), bytes.size(), 0);
  bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  return bytes;
}

std::string Socket::peer_name() const {
  X509* const peer = SSL_get1_peer_certificate(tls_->ssl);
  if (peer == nullptr) return "";
  std::array<char, 100> name{};
  X509_NAME_get_text_by_NID(X509_get_subject_name(peer), NID_commonName, name.data(), name.size());
  X509_free(peer);
  return name.data();
}

std::string Socket::version() const { return SSL_get_version(tls_->ssl); }

std::string Socket::protocol() const {
  const unsigned char* name = nullptr;
  unsigned int size = 0;
  SSL_get0_alpn_selected(tls_->ssl, &name, &size);
  return {reinterpret_cast<const char*>(name), size};
}

void Socket::say_goodbye() { SSL_shutdown(tls_->ssl); }

bool Socket::change_key() {
  return SSL_key_update(tls_->ssl, SSL_KEY_UPDATE_REQUESTED) == 1 &&
         SSL_do_handshake(tls_->ssl) == 1;
}

bool Socket::closed_by_peer(int timeout_ms) {
  const auto end = in_ms(timeout_ms);
  while (!receive(left_ms(end)).empty()) {
  }
  return left_ms(end) > 0;
}

void Socket::half_close() const { ::shutdown(handle_, SHUT_WR); }

std::string Answer::header(const std::string& name) const {
  const auto found = headers.find(name);
  return found == headers.end() ? "" : found->second;
}

Answer read_answer(Socket& socket, bool head) {
  Answer answer;
  std::string bytes;
  std::size_t end = std::string::npos;
  while (end == std::string::npos) {
    const std::string more = socket.receive();
    if (more.empty()) return answer;
    bytes += more;
    end = bytes.find("\r\n\r\n");
  }
  parse_head(bytes.substr(0, end + 2), answer);
  answer.body = bytes.substr(end + 4);
  const std::string length = answer.header("content-length");
  while (!head && !length.empty() && answer.body.size() < std::stoul(length)) {
    const std::string more = socket.receive();
    if (more.empty()) break;
    answer.body += more;
  }
  return answer;
}

Answer request(Place place, const std::string& method, const std::string& target,
               const Headers& headers, const std::string& body) {
  std::string text = method + ' ' + target +
                     " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(place.port) +
                     "\r\nConnection: close\r\n";
  add_headers(headers, text);
  if (!body.empty() || method == "POST") {
    text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  }
  Socket socket(place);
  socket.send(text + "\r\n" + body);
  return read_answer(socket, method == "HEAD");
}

Answer get(Place place, const std::string& target, const Headers& headers) {
  return request(place, "GET", target, headers);
}

Answer post_view(Place place, const std::string& json, const Headers& headers) {
  Headers all{{"Content-Type", "application/json"}};
  all.insert(all.end(), headers.begin(), headers.end());
  return request(place, "POST", "/v1/frames", all, json);
}

Answer raw(Place place, std::string_view bytes) {
  Socket socket(place);
  socket.send(bytes);
  return read_answer(socket);
}

StreamClient::StreamClient(Place place, const Headers& headers, const std::string& target,
                           int receive_buffer_bytes)
    : socket(place, receive_buffer_bytes) {
  std::string text =
      "GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(place.port) +
      "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
  add_headers(headers, text);
  socket.send(text + "\r\n");
  std::size_t end = std::string::npos;
  while ((end = buffer_.find("\r\n\r\n")) == std::string::npos) {
    const std::string more = socket.receive();
    if (more.empty()) return;
    buffer_ += more;
  }
  parse_head(buffer_.substr(0, end + 2), handshake_);
  buffer_.erase(0, end + 4);
}

bool StreamClient::send_frame(Opcode opcode, std::string_view payload, bool fin) {
  std::string frame(1, static_cast<char>((fin ? 0x80 : 0) | static_cast<int>(opcode)));
  if (payload.size() < 126) {
    frame += static_cast<char>(0x80 | payload.size());
  } else if (payload.size() < 65536) {
    frame += static_cast<char>(0x80 | 126);
    frame += static_cast<char>(payload.size() >> 8);
    frame += static_cast<char>(payload.size() & 0xff);
  } else {
    frame += static_cast<char>(0x80 | 127);
    for (int shift = 56; shift >= 0; shift -= 8) {
      frame += static_cast<char>(payload.size() >> shift & 0xff);
    }
  }
  constexpr std::array<char, 4> mask{0x12, 0x34, 0x56, 0x78};
  frame.append(mask.data(), mask.size());
  for (std::size_t i = 0; i < payload.size(); ++i) {
    frame += static_cast<char>(payload[i] ^ mask[i % mask.size()]);
  }
  return socket.send(frame);
}

bool StreamClient::fill(std::size_t bytes, int timeout_ms) {
  const auto end = in_ms(timeout_ms);
  while (buffer_.size() < bytes) {
    const std::string more = socket.receive(left_ms(end));
    if (more.empty()) return false;
    buffer_ += more;
  }
  return true;
}

std::optional<Message> StreamClient::next(int timeout_ms) {
  const auto end = in_ms(timeout_ms);  // pings of the server do not move it
  while (true) {
    if (!fill(2, left_ms(end))) return std::nullopt;
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(buffer_[at]); };
    const std::size_t short_length = byte(1) & 0x7fU;
    const std::size_t length_bytes = short_length < 126 ? 0 : short_length == 126 ? 2 : 8;
    if (!fill(2 + length_bytes, left_ms(end))) return std::nullopt;
    std::size_t length = length_bytes == 0 ? short_length : 0;
    for (std::size_t i = 0; i < length_bytes; ++i) length = length << 8 | byte(2 + i);
    if (!fill(2 + length_bytes + length, left_ms(end))) return std::nullopt;
    Message message;
    message.kind = static_cast<Opcode>(byte(0) & 0x0fU);
    message.data = buffer_.substr(2 + length_bytes, length);
    buffer_.erase(0, 2 + length_bytes + length);
    if (message.kind == Opcode::ping) {
      send_frame(Opcode::pong, message.data);
      continue;
    }
    if (message.kind == Opcode::pong) continue;
    if (message.kind == Opcode::close && message.data.size() >= 2) {
      message.close_code = static_cast<unsigned char>(message.data[0]) << 8 |
                           static_cast<unsigned char>(message.data[1]);
      send_frame(Opcode::close, message.data.substr(0, 2));
    }
    if (message.kind == Opcode::text) texts.push_back(message.data);
    return message;
  }
}

std::optional<std::string> StreamClient::next_text(const std::string& type, int timeout_ms) {
  const auto end = in_ms(timeout_ms);
  while (auto message = next(left_ms(end))) {
    if (message->kind == Opcode::text && type_of(message->data) == type) return message->data;
  }
  return std::nullopt;
}

std::optional<std::string> StreamClient::next_frame(int timeout_ms) {
  const auto end = in_ms(timeout_ms);
  while (auto message = next(left_ms(end))) {
    if (message->kind == Opcode::binary) return message->data;
  }
  return std::nullopt;
}

int StreamClient::close_code(int timeout_ms) {
  const auto end = in_ms(timeout_ms);
  while (auto message = next(left_ms(end))) {
    if (message->kind == Opcode::close) return message->close_code;
  }
  return 0;
}

}  // namespace server_test
