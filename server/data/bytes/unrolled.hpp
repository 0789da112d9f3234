// Encoded bytes (gzip, hexadecimal, numbers as text) as if they lay there plain. A stream can only
// be followed forwards: where it was passed is remembered here and there, so that a step of a long
// series is reached without memory for the others.
#pragma once

#include <cstdint>
#include <memory>

#include "server/base/error.hpp"
#include "server/data/bytes/byte_store.hpp"

namespace windsplat::data::bytes {

enum class Encoding {
  gzip,  // or zlib; members may follow one another
  hex,   // two digits a byte, blanks between them
  text,  // numbers between blanks or commas: eight bytes each, float64 of this machine
};

// Refused as impossible: a claim that no encoding of so few bytes can fulfil.
// encoded: bytes of the file from the data's beginning on; claim: decoded ones.
bool can_hold(Encoding encoding, std::uint64_t encoded, std::uint64_t claim);

// The encoded data of a file from `skip` on, of which `bytes` are wanted once decoded; the first
// `drop` decoded bytes count as not there.
std::shared_ptr<ByteStore> unrolled_store(std::shared_ptr<const InputFile> file, Encoding encoding,
                                          std::uint64_t skip, std::uint64_t bytes,
                                          std::uint64_t drop = 0);

// Where `count` numbers of text that begin at `skip` end. Errors: bad_data for what is no number.
Result<std::uint64_t> end_of_text(const std::shared_ptr<const InputFile>& file, std::uint64_t skip,
                                  std::uint64_t count);

}  // namespace windsplat::data::bytes
