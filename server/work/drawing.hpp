// Draws a picture: at once if all data is resident, otherwise after loading.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/frame/frame.hpp"
#include "server/work/backend.hpp"

namespace windsplat::net {

struct Drawing {
  RenderService::Kind kind = RenderService::Kind::request;
  std::uint64_t owner = 0;
  CancelToken cancel;
  std::shared_ptr<data::Dataset> dataset;
  // On the renderer's thread: draws and replies. With `after_load` false nothing is loaded: returns
  // false without a reply if data is missing. Must not throw.
  std::function<bool(data::Dataset& dataset, std::int64_t queue_us, bool after_load)> draw;
  // On a loading thread: loads what draw() needs and returns an object that pins it, including the
  // memory reserved for the picture. Errors name the dataset (naming()). Must not throw.
  std::function<Result<std::shared_ptr<const void>>(data::Dataset& dataset)> load;
  // On either thread: replies with an error.
  std::function<void(const Error& error)> fail;
  double cost_ms = 0;  // see RenderJob
  std::string payer;
};

// Reserves the memory of a large picture beyond the reserve that the memory limit includes, held
// while it is drawn and encoded; null if none is needed. Error: not_resident, so that
// load_picture() waits for it; after that call the memory is available.
Result<std::shared_ptr<const void>> reserve_picture(const data::Dataset& dataset,
                                                    const protocol::ImageView& image,
                                                    const frame::Encoding& encoding,
                                                    bool after_load);

// For Drawing::load: frame::load(), then the reservation. Errors: those of both; out_of_memory,
// with the bytes that the picture needs.
Result<std::shared_ptr<const void>> load_picture(const protocol::View& view, data::Dataset& loading,
                                                 const frame::Encoding& encoding);

// Draw or fail replies exactly once unless this returns an error: busy. Loads of requests are
// subject to admission; sessions bound the loads of streams, one picture at a time each.
Result<void> submit(Backend& backend, Drawing drawing);

}  // namespace windsplat::net
