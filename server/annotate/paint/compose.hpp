// Pictures with an overlay.
#pragma once

#include <vector>

#include "server/annotate/paint/overlay.hpp"
#include "server/base/thread_pool.hpp"
#include "server/image/ycc.hpp"

namespace windsplat::annotate {

// YccPicture::put with what lies over and under the part. Disjoint parts may be written
// concurrently.
void put(const Overlay& overlay, const image::Part& part, image::YccPicture& planes);

// The overlay of a picture without data, for the pixels that are not put later.
void put_empty(const Overlay& overlay, ThreadPool& pool, image::YccPicture& planes);

// Composites a whole picture: linear premultiplied RGBA of the size of the overlay.
void composite(const Overlay& overlay, ThreadPool& pool, std::vector<float>& rgba);

}  // namespace windsplat::annotate
