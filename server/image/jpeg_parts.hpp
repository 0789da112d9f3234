// JPEGs of strips -> one JPEG (ITU-T T.81, annex B).
#pragma once

#include <cstdint>
#include <span>

#include "server/base/error.hpp"
#include "server/image/encode.hpp"

namespace windsplat::image {

struct Stitching {
  int width = 0;  // of the whole picture, pixels
  int height = 0;
  int strip_mcus = 0;  // of every strip but the last, which may be shorter; at most 65535
};

// Every strip is a baseline JPEG of one scan without restarts, all of the same tables, and as wide
// as the picture in MCUs. The result begins with the first one's header, told the picture's size
// and the restart interval, and has a restart marker between any two strips: there the prediction
// of DC starts anew, as it did in each strip. Errors: internal (a strip is not such a JPEG,
// or its header is not the first one's but for the height).
Result<void> stitch(std::span<const std::span<const std::uint8_t>> strips,
                    const Stitching& stitching, Bytes& bytes);

}  // namespace windsplat::image
