// The interface of a session to its environment, and its time limits.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/quality/table.hpp"
#include "server/session/pacing/link.hpp"

namespace windsplat::session {

struct Options {
  Micros idle_timeout_us = 300'000'000;  // time without a message
  Micros quiet_us = 120'000;             // time without a change, before the final frame
  Micros quiet_most_us = 1'000'000;      // maximum of quiet_us for slow links
  bool video = false;                    // H.264 can be encoded
};

// Checks whether a view can be drawn, without loading; the value is the number of steps of its
// dataset.
using Check = std::function<Result<int>(const protocol::View&)>;

// Progress of the current read of a dataset, if any. Must not block.
struct Reading {
  std::string field;
  double done = 0;  // fraction, 0 to 1
};
using WhatIsRead = std::function<std::optional<Reading>(const std::string& dataset)>;

// Known errors and times of the settings.
using Forecaster =
    std::function<quality::Forecasts(const quality::SceneSignature&, const quality::Viewpoint&)>;

// Milliseconds that method `kernel` may need for a view, by the number of its kernels and before
// its data are known; 0: unknown.
using TimeByWork = std::function<double(const protocol::View&)>;

// Recent time that frames of streams waited for the renderer.
using Waiting = std::function<Micros()>;

// Whether the session may draw a frame of the scene at a setting whose time is unknown although
// frames wait for the renderer.
using MayTry = std::function<bool(const quality::SceneSignature&)>;

// Queries of a session to its environment. None may block.
struct Surroundings {
  Check check;
  WhatIsRead what_is_read;       // may be empty
  Forecaster forecasts;          // empty: the prior
  Waiting waiting = {};          // empty: unknown
  MayTry may_try = {};           // empty: it may not
  TimeByWork time_by_work = {};  // empty: unknown
};

}  // namespace windsplat::session
