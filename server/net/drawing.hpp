// A picture's way through the two services: drawn at once where all it shows is resident, else
// loaded first and then drawn.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/net/router.hpp"

namespace windsplat::net {

struct Drawing {
  RenderService::Kind kind = RenderService::Kind::request;
  std::uint64_t owner = 0;
  CancelToken cancel;
  std::shared_ptr<data::Dataset> dataset;
  // On the renderer's thread: draws and answers. With `after_load` false the dataset never loads;
  // where it has not all that is needed: false, and nothing was answered. Must not throw.
  std::function<bool(data::Dataset& dataset, std::int64_t queue_us, bool after_load)> draw;
  // On a loading thread: loads what draw() needs and gives something that holds it. Must not throw.
  std::function<Result<std::shared_ptr<const void>>(data::Dataset& dataset)> load;
  // On either: answers an error.
  std::function<void(const Error& error)> fail;
  double cost_ms = 0;  // see RenderJob
  std::string payer;
};

// Room for what a picture takes beyond what a memory limit keeps back for any, held while it is
// drawn and encoded; null where it needs none. Errors: out_of_memory, with what is needed.
Result<std::shared_ptr<const void>> reserve_picture(Services& services, int width, int height,
                                                    frame::Format format);

// One of draw's or fail's answers comes, unless this is an error: busy. Loads of requests are
// admitted like others; a stream has one picture at a time, so that its sessions bound them.
Result<void> submit(Services& services, Drawing drawing);

}  // namespace windsplat::net
