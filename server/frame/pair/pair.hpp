// Two frames of equal size -> one picture of both, side by side.
#pragma once

#include <array>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/frame/frame.hpp"
#include "server/image/encode.hpp"

namespace windsplat::frame {

// Columns of grey between two pictures of that height.
int gap_of_pair(int height);

// The first frame on the left, the second on the right. `frames`: raw, of equal size and of the
// format png or that of `encoding`, as raw_of_pair() says. The pixels of a png, pdf or svg are
// those of the frames. Errors: invalid for npy, whose arrays have no place for two; cancelled.
Result<image::Bytes> encode_pair(const std::array<Frame, 2>& frames, const Encoding& encoding,
                                 const CancelToken& cancel = {});

// How the frames of a pair of that encoding are drawn. Errors: invalid for npy.
Result<Encoding> raw_of_pair(const Encoding& encoding);

}  // namespace windsplat::frame
