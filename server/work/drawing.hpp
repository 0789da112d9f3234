// A picture's way through the two backend: drawn at once where all it shows is resident, else
// loaded first and then drawn.
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
  // On the renderer's thread: draws and answers. With `after_load` false the dataset never loads;
  // where it has not all that is needed: false, and nothing was answered. Must not throw.
  std::function<bool(data::Dataset& dataset, std::int64_t queue_us, bool after_load)> draw;
  // On a loading thread: loads what draw() needs and gives something that holds it, the picture's
  // room among it. Errors name the dataset (naming()). Must not throw.
  std::function<Result<std::shared_ptr<const void>>(data::Dataset& dataset)> load;
  // On either: answers an error.
  std::function<void(const Error& error)> fail;
  double cost_ms = 0;  // see RenderJob
  std::string payer;
};

// Room for what a picture of a view takes beyond what a memory limit keeps back for any, held while
// it is drawn and encoded; null where it needs none. Error: not_resident, so that it is waited for
// by load_picture(); after that it is there already.
Result<std::shared_ptr<const void>> reserve_picture(const data::Dataset& dataset,
                                                    const protocol::ImageView& image,
                                                    const frame::Encoding& encoding,
                                                    bool after_load);

// For Drawing::load: frame::load(), and then the room. Errors: those; out_of_memory, with what the
// picture needs.
Result<std::shared_ptr<const void>> load_picture(const protocol::View& view, data::Dataset& loading,
                                                 const frame::Encoding& encoding);

// One of draw's or fail's answers comes, unless this is an error: busy. Loads of requests are
// admitted like others; a stream has one picture at a time, so that its sessions bound them.
Result<void> submit(Backend& backend, Drawing drawing);

}  // namespace windsplat::net
