// Sockets by poll(); HTTP/1.1 and RFC 6455 as far as the tests need them.
#include "client.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <nlohmann/json.hpp>

namespace net_test {
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

Socket::Socket(std::uint16_t port, int receive_buffer_bytes) {
  handle_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (receive_buffer_bytes > 0) {
    ::setsockopt(handle_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes,
                 sizeof receive_buffer_bytes);
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(handle_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(handle_);
    handle_ = -1;
  }
}

Socket::~Socket() {
  if (handle_ >= 0) ::close(handle_);
}

bool Socket::send(std::string_view bytes) {
  if (handle_ < 0) return false;
  const auto end = in_ms(patience_ms);
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
  pollfd ready{handle_, POLLIN, 0};
  if (::poll(&ready, 1, timeout_ms) <= 0) return {};
  std::string bytes(65536, '\0');
  const auto got = ::recv(handle_, bytes.data(), bytes.size(), 0);
  bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  return bytes;
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

Answer request(std::uint16_t port, const std::string& method, const std::string& target,
               const Headers& headers, const std::string& body) {
  std::string text = method + ' ' + target +
                     " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                     "\r\nConnection: close\r\n";
  add_headers(headers, text);
  if (!body.empty() || method == "POST") {
    text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  }
  Socket socket(port);
  socket.send(text + "\r\n" + body);
  return read_answer(socket, method == "HEAD");
}

Answer get(std::uint16_t port, const std::string& target, const Headers& headers) {
  return request(port, "GET", target, headers);
}

Answer post_view(std::uint16_t port, const std::string& json, const Headers& headers) {
  Headers all{{"Content-Type", "application/json"}};
  all.insert(all.end(), headers.begin(), headers.end());
  return request(port, "POST", "/v1/frames", all, json);
}

Answer raw(std::uint16_t port, std::string_view bytes) {
  Socket socket(port);
  socket.send(bytes);
  return read_answer(socket);
}

StreamClient::StreamClient(std::uint16_t port, const Headers& headers, const std::string& target,
                           int receive_buffer_bytes)
    : socket(port, receive_buffer_bytes) {
  std::string text =
      "GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
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
  while (true) {
    if (!fill(2, timeout_ms)) return std::nullopt;
    const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(buffer_[at]); };
    const std::size_t short_length = byte(1) & 0x7fU;
    const std::size_t length_bytes = short_length < 126 ? 0 : short_length == 126 ? 2 : 8;
    if (!fill(2 + length_bytes, timeout_ms)) return std::nullopt;
    std::size_t length = length_bytes == 0 ? short_length : 0;
    for (std::size_t i = 0; i < length_bytes; ++i) length = length << 8 | byte(2 + i);
    if (!fill(2 + length_bytes + length, timeout_ms)) return std::nullopt;
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

}  // namespace net_test
