// Planes of YCbCr -> one baseline JPEG, its strips coded side by side.
#pragma once

#include <memory>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/image/ycc.hpp"

namespace windsplat::image {

// Keeps compressors and buffers from one picture to the next. One picture at a time.
class JpegEncoder {
 public:
  JpegEncoder();
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  // `bytes` is overwritten; its storage is used again. Strips follow from the picture's size alone,
  // so that any number of threads gives the same bytes. quality 1..100. Errors: too_large, invalid,
  // internal; cancelled, noticed between strips.
  Result<void> encode(const YccPicture& picture, int quality, ThreadPool& pool, Bytes& bytes,
                      const CancelToken& cancel = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::image
