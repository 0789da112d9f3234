// Random access to encoded bytes (gzip, hexadecimal, numbers as text). A stream can be decoded
// forwards only: the decoder state is saved at checkpoints, so that a step of a long series is
// reached without keeping the others in memory.
#pragma once

#include <cstdint>
#include <memory>

#include "server/base/error.hpp"
#include "server/data/bytes/byte_store.hpp"

namespace windsplat::data::bytes {

enum class Encoding {
  gzip,  // or zlib; may have several members
  hex,   // two digits per byte, separated by optional blanks
  text,  // numbers separated by blanks or commas; decoded to eight bytes each, float64 in native
         // byte order
};

// Whether the encoded bytes can decode to the declared size. encoded: bytes of the file from the
// start of the data to its end; claim: declared decoded bytes.
bool can_hold(Encoding encoding, std::uint64_t encoded, std::uint64_t claim);

// The encoded data of a file, starting at `skip`; the first `drop` decoded bytes are skipped and
// the next `bytes` are used.
std::shared_ptr<ByteStore> unrolled_store(std::shared_ptr<const InputFile> file, Encoding encoding,
                                          std::uint64_t skip, std::uint64_t bytes,
                                          std::uint64_t drop = 0);

// Offset after `count` numbers of text that begin at `skip`. Errors: bad_data if one is not a
// number.
Result<std::uint64_t> end_of_text(const std::shared_ptr<const InputFile>& file, std::uint64_t skip,
                                  std::uint64_t count);

}  // namespace windsplat::data::bytes
