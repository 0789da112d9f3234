// Messages of a compromised loader: bytes on its socket, and the payloads of each kind of message.
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "server/data/cf/grid/grid.hpp"
#include "server/data/loader/channel.hpp"
#include "server/data/loader/messages.hpp"
#include "tests/fuzz/support/check.hpp"

namespace {

using fuzz::expect;
using namespace windsplat::data;
namespace loader = windsplat::data::loader;

void expect_info(const DatasetInfo& info) {
  expect(!info.fields.empty() && !info.steps.empty(), "a dataset has data");
  std::uint64_t samples = 1;
  for (const Axis& axis : info.grid.axes) {
    expect(!axis.coordinates.empty(), "an axis has coordinates");
    for (const double at : axis.coordinates) expect(std::isfinite(at), "coordinates are finite");
    samples *= axis.coordinates.size();
    expect(samples <= cf::samples_max, "a grid is within the limit");
  }
  for (const FieldInfo& field : info.fields) {
    expect(!field.name.empty() && field.components.size() <= 3 && !field.components.empty(),
           "a field has a name and one to three components");
  }
  // Strings are printable after the first round.
  const std::string once = loader::encode_info(info);
  const auto again = loader::decode_info(once);
  expect(again.has_value(), "accepted info is accepted again");
  expect(loader::encode_info(*again) == once, "accepted info is unchanged");
}

void decode(std::string_view payload) {
  if (const auto info = loader::decode_info(payload)) expect_info(*info);
  const auto error = loader::decode_error(payload);
  expect(!error.message.empty() && error.message.size() <= 4000, "an error has a message");
  expect(windsplat::printable(error.message, 4000) == error.message, "a message is printable",
         error.message);
  if (const auto names = loader::decode_names(payload)) {
    expect(loader::encode_names(*names) == payload, "names are unchanged");
  }
  if (const auto task = loader::decode_task(payload)) {
    const auto again = loader::decode_task(loader::encode_task(*task));
    expect(again && loader::encode_task(*again) == loader::encode_task(*task),
           "a task is unchanged");
  }
}

}  // namespace

// Even first byte: a payload. Odd: bytes on the socket until it is closed.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes = fuzz::text_of(data + 1, size - 1);
  if (data[0] % 2 == 0) {
    decode(bytes);
    return 0;
  }
  std::array<int, 2> pair{-1, -1};
  expect(::socketpair(AF_UNIX, SOCK_STREAM, 0, pair.data()) == 0, "a pair of sockets");
  const Descriptor ours(pair[0]);
  Descriptor theirs(pair[1]);
  // Inputs are smaller than the socket buffer.
  const std::string_view sent = bytes.substr(0, std::size_t{64} * 1024);
  expect(::send(theirs.number(), sent.data(), sent.size(), MSG_NOSIGNAL) ==
             static_cast<ssize_t>(sent.size()),
         "the input fits the socket buffer");
  theirs.reset();
  const loader::Deadline deadline = loader::Clock::now() + std::chrono::seconds(5);
  for (int i = 0; i < 64; ++i) {
    loader::Message message;
    const auto fate = loader::receive_message(ours.number(), message, loader::question_bytes_max,
                                              loader::Descriptors::refused, deadline);
    if (fate != loader::Fate::done) {
      expect(fate != loader::Fate::late, "a closed socket must not be waited for");
      break;
    }
    expect(message.payload.size() <= loader::question_bytes_max, "a message is within its limit");
    expect(!message.descriptor, "no descriptor was sent");
    decode(message.payload);
  }
  return 0;
}
