// Planes of YCbCr -> one baseline JPEG, encoded as strips in parallel.
#pragma once

#include <memory>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/image/ycc.hpp"

namespace windsplat::image {

// Keeps compressors and buffers between pictures. Not for concurrent use.
class JpegEncoder {
 public:
  JpegEncoder();
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  // Overwrites `bytes`, reusing its storage. The strips depend only on the picture size, so that
  // the result is independent of the number of threads. quality 1..100. Errors: too_large, invalid,
  // internal; cancelled, checked between strips.
  Result<void> encode(const YccPicture& picture, int quality, ThreadPool& pool, Bytes& bytes,
                      const CancelToken& cancel = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::image
