// A few numbers for each key, computed once for all threads.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"

namespace windsplat::data {

// Thread-safe. Keeps the numbers of the last 256 keys.
class Remembered {
 public:
  using Make = std::function<Result<std::vector<double>>()>;
  enum class Meeting {  // what a caller does while another thread computes the same numbers
    wait,
    leave,      // does not wait: the renderer
    disregard,  // others do not wait for this one either, which may itself wait for what they hold
  };

  // The numbers of `key`, or those of `make`, whose failures are not kept: one that waited computes
  // them then. Errors: those of `make`; cancelled, by `cancel` during the wait; not_resident if the
  // caller leaves.
  Result<std::vector<double>> get(const std::string& key, Meeting meeting,
                                  const CancelToken& cancel, const Make& make);

 private:
  // Enters `key` as in progress. The numbers, if they are known; an error if the caller is to end.
  Result<std::optional<std::vector<double>>> enter(const std::string& key, Meeting meeting,
                                                   const CancelToken& cancel);
  void leave(const std::string& key);

  std::mutex mutex_;  // guards all members below
  std::condition_variable changed_;
  std::deque<std::pair<std::string, std::vector<double>>> known_;
  std::set<std::string> in_progress_;  // keys that others wait for
};

}  // namespace windsplat::data
