// Messages between the daemon and a loader over a stream socket: a frame of 16 bytes, a payload,
// and at most one descriptor, which goes to the loader only.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/data/files/descriptor.hpp"

namespace windsplat::data::loader {

enum class Kind : std::uint32_t {
  // daemon -> loader: what to do
  open = 1,  // settings and location -> opened or failed
  read,      // field, step, box; with the memory to fill -> filled, whole or failed
  // daemon -> loader: answers to requests of the loader
  descriptor,  // answer: success, with a descriptor; of a file in parts its number and state
  names,
  yes,
  no,  // answer: failure, with an error or empty
  // loader -> daemon: requests
  ask_open,
  ask_list,
  ask_exists,
  ask_library,
  // loader -> daemon: progress and answers
  progress,
  opened,
  filled,
  failed,
  // of files in parts
  ask_bytes,    // loader -> daemon: number of parts, offset, count -> extent, or no without payload
  extent,       // daemon -> loader: bytes that are present
  close_parts,  // loader -> daemon: number of parts; no answer
  ask_parts,    // loader -> daemon: as ask_open, of a file that is to be read in parts
  expect,       // loader -> daemon: what will be asked for soon (Expected); no answer
  // of volumes that are passed in parts
  part,   // loader -> daemon: component, layers and half of the window -> taken, in order
  taken,  // daemon -> loader: that half may be overwritten
  whole,  // loader -> daemon: answer to read: the field cannot be read in parts
  // of archives
  unpack,       // daemon -> loader: what to do, with the archive -> entries or failed
  entries,      // loader -> daemon: bytes of disk; then each entry and its bytes
  entry,        // loader -> daemon: name
  entry_bytes,  // loader -> daemon: the next bytes of the last entry
  unpacked,     // loader -> daemon: that was all
};

using Clock = std::chrono::steady_clock;
using Deadline = std::optional<Clock::time_point>;  // none: unlimited

enum class Fate {
  done,
  closed,  // closed by the peer, at any point
  late,
  broken,  // the received bytes are not a message or exceed its limit
};

// done: data can be received, or the peer has closed the channel.
Fate wait_for_message(int socket, const Deadline& deadline);

struct Frame {
  std::uint32_t kind = 0;
  std::uint32_t zero = 0;
  std::uint64_t bytes = 0;
};

// Async-signal-safe: no allocation. `descriptor` -1: none is sent.
Fate send_message(int socket, Kind kind, const char* payload, std::size_t bytes, int descriptor,
                  const Deadline& deadline);
// Exactly `bytes`; a received descriptor is closed unless `descriptor` is given.
Fate receive_bytes(int socket, char* out, std::size_t bytes, Descriptor* descriptor,
                   const Deadline& deadline);

struct Message {
  Kind kind = Kind::failed;
  std::string payload;
  Descriptor descriptor;
};

enum class Descriptors { refused, taken };

// Payloads are allocated as they arrive, not by the announced length.
Fate receive_message(int socket, Message& out, std::size_t bytes_max, Descriptors descriptors,
                     const Deadline& deadline);

inline Fate send_message(int socket, Kind kind, std::string_view payload, int descriptor,
                         const Deadline& deadline) {
  return send_message(socket, kind, payload.data(), payload.size(), descriptor, deadline);
}

}  // namespace windsplat::data::loader
