// JPEGs of strips -> one JPEG (ITU-T T.81, annex B).
#pragma once

#include <cstdint>
#include <span>

#include "server/base/error.hpp"
#include "server/image/encode.hpp"

namespace windsplat::image {

struct Stitching {
  int width = 0;  // size of the whole picture, pixels
  int height = 0;
  int strip_mcus = 0;  // height of every strip but the last, which may be less; at most 65535
};

// Each strip must be a baseline JPEG of one scan without restart intervals, with the same tables
// and the width of the picture in MCUs. The result has the header of the first strip with the size
// of the picture and the restart interval, and a restart marker between strips, where DC prediction
// restarts. Errors: internal (a strip is not such a JPEG, or its header differs from the first by
// more than the height).
Result<void> stitch(std::span<const std::span<const std::uint8_t>> strips,
                    const Stitching& stitching, Bytes& bytes);

}  // namespace windsplat::image
