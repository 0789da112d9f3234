// The store's prefetch thread. Prefetch requests in, resident volumes out.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "server/data/resident/store.hpp"

namespace windsplat::data {

class PrefetchThread {
 public:
  explicit PrefetchThread(std::shared_ptr<Budget> budget);
  ~PrefetchThread();  // ends after the load in work
  PrefetchThread(const PrefetchThread&) = delete;
  PrefetchThread& operator=(const PrefetchThread&) = delete;

  // See Store::request_prefetch.
  void request_prefetch(std::uint64_t owner, std::vector<PrefetchRequest> requests);
  // Stops prefetching for a dataset.
  void forget(const DatasetInfo& info);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace windsplat::data
