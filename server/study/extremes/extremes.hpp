// The battery of stiff and extreme cases: every case by every method, compared with an independent
// truth.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/study/extremes/judge.hpp"

namespace windsplat::study {

struct Extremes {
  std::vector<CaseResult> cases;
  std::vector<Trust> trust;
  [[nodiscard]] std::size_t failed() const;
};

// listen (may be empty): name of the group in progress, and the finished part of all groups, 0..1.
using GroupListener = std::function<void(const std::string& group, double done)>;

// The groups of these names; all if empty. Each case is a view like that of a request: checked,
// completed, drawn and measured by the code that serves requests. Errors: cancelled.
Result<Extremes> run_extremes(const std::vector<std::string>& names, ThreadPool& pool,
                              const CancelToken& cancel, const GroupListener& listen);

}  // namespace windsplat::study
