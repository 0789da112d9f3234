// Draws a picture: at once if all data is resident, otherwise after loading.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/frame/frame.hpp"
#include "server/quality/setting.hpp"
#include "server/tasks/backend.hpp"

namespace windsplat::tasks {

// A picture ready to be drawn: its scene and the memory reserved for its pixels.
struct PreparedPicture {
  frame::Prepared frame;
  std::shared_ptr<const void> reserved;
};
using PreparedPtr = std::shared_ptr<PreparedPicture>;

// Whether data that is not resident may be loaded, which blocks.
enum class Loading { none, allowed };

struct Drawing {
  RenderService::Kind kind = RenderService::Kind::request;
  std::uint64_t owner = 0;
  CancelToken cancel;
  std::shared_ptr<data::Dataset> dataset;
  // On the renderer's thread with resident data and, if that yields not_resident, again on a
  // loading thread. Null: it has replied, and there is nothing to draw. Must not throw.
  std::function<Result<PreparedPtr>(data::Dataset& dataset, Loading loading)> prepare;
  // On the renderer's thread: draws and replies. Must not throw.
  std::function<void(const PreparedPicture& picture, data::Dataset& dataset, std::int64_t queue_us,
                     Loading loading)>
      draw;
  // On either thread: replies with an error.
  std::function<void(const Error& error)> fail;
  double cost_ms = 0;  // see RenderJob
  std::string payer;
};

// Reserves the memory of a large picture beyond the reserve that the memory limit includes. Errors:
// not_resident if memory is missing and nothing may be loaded; otherwise out_of_memory with the
// bytes that the picture needs.
Result<PreparedPtr> with_memory(frame::Prepared prepared, const data::Dataset& dataset,
                                Loading loading);

// Prepares a completed view at a setting with the memory of its picture. Errors: those of
// frame::prepare(), with the name of the dataset if data may be loaded, and of with_memory().
Result<PreparedPtr> prepare_picture(const scene::CompletedView& completed,
                                    const quality::Setting& setting,
                                    const frame::Encoding& encoding, data::Dataset& dataset,
                                    Loading loading,
                                    scene::StandIn stand_in = scene::StandIn::none);

// draw() or fail() replies exactly once unless this function returns an error: busy. Loads of
// requests are subject to admission; sessions limit the loads of streams to one picture at a time
// each.
Result<void> submit(Backend& backend, Drawing drawing);

}  // namespace windsplat::tasks
