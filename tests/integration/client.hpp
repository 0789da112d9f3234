// Minimal client for network tests: plain sockets with deadlines, which can also send invalid data.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace server_test {

using Headers = std::vector<std::pair<std::string, std::string>>;

inline const Headers json_type{{"Content-Type", "application/json"}};

inline constexpr int patience_ms = 60'000;  // longer waits are failures

// A port of this machine, and whether it uses TLS.
struct Place {
  Place(std::uint16_t number, bool with_tls = false)  // NOLINT: a port's number is a place
      : port(number), tls(with_tls) {}
  std::uint16_t port;
  bool tls;
};

// A TCP connection to this machine, with or without TLS. The certificate is not verified;
// peer_name() returns its name.
class Socket {
 public:
  explicit Socket(Place place, int receive_buffer_bytes = 0);
  ~Socket();
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  // Writes as much as the peer accepts; false if it has closed.
  bool send(std::string_view bytes);
  // Reads at least one byte; empty at the end, on a reset or after the deadline.
  std::string receive(int timeout_ms = patience_ms);
  // Waits until the peer has closed; false if it does not.
  bool closed_by_peer(int timeout_ms = patience_ms);
  void half_close() const;

  // For TLS: whether the handshake completed, the common name of the peer's certificate, and the
  // negotiated versions ("TLSv1.3", "http/1.1").
  [[nodiscard]] bool shaken() const { return shaken_; }
  [[nodiscard]] std::string peer_name() const;
  [[nodiscard]] std::string version() const;
  [[nodiscard]] std::string protocol() const;
  void say_goodbye();  // close_notify of TLS 1.3: a record without application data
  bool change_key();   // of TLS 1.3: a record without data for HTTP

 private:
  struct Tls;
  bool wait_for(int ssl_result, int timeout_ms);

  int handle_ = -1;
  bool shaken_ = false;
  std::unique_ptr<Tls> tls_;
};

struct Answer {
  int status = 0;                              // 0: no response
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;

  [[nodiscard]] std::string header(const std::string& name) const;
};

// Reads one response. `head`: it has no body, whatever its length header.
Answer read_answer(Socket& socket, bool head = false);

// Sends one request on a separate connection.
Answer request(Place place, const std::string& method, const std::string& target,
               const Headers& headers = {}, const std::string& body = "");
Answer get(Place place, const std::string& target, const Headers& headers = {});
Answer post_view(Place place, const std::string& json, const Headers& headers = {});
// unmodified bytes
Answer raw(Place place, std::string_view bytes);

enum class Opcode : std::uint8_t { more = 0, text = 1, binary = 2, close = 8, ping = 9, pong = 10 };

struct Message {
  Opcode kind = Opcode::text;
  std::string data;
  int close_code = 0;  // of a close; 0 if absent
};

// A WebSocket. Answers pings automatically; acknowledges nothing.
class StreamClient {
 public:
  explicit StreamClient(Place place, const Headers& headers = {},
                        const std::string& target = "/v1/stream", int receive_buffer_bytes = 0);

  [[nodiscard]] const Answer& handshake() const { return handshake_; }

  bool say(std::string_view json) { return send_frame(Opcode::text, json); }
  bool send_frame(Opcode opcode, std::string_view payload, bool fin = true);
  // Text, binary or close; nullopt if the connection ended otherwise or the deadline passed.
  std::optional<Message> next(int timeout_ms = patience_ms);
  // The next text message of that type; others are skipped.
  std::optional<std::string> next_text(const std::string& type, int timeout_ms = patience_ms);
  // The next frame; text messages are skipped and kept in `texts`.
  std::optional<std::string> next_frame(int timeout_ms = patience_ms);
  // The code of the next close, skipping earlier messages; 0 if there is none.
  int close_code(int timeout_ms = patience_ms);

  std::vector<std::string> texts;  // all text messages so far
  Socket socket;

 private:
  bool fill(std::size_t bytes, int timeout_ms);

  Answer handshake_;
  std::string buffer_;
};

}  // namespace server_test
